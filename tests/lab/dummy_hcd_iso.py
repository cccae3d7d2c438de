"""usage: dummy_hcd_iso.py dummy_hcd.c   edits the kernel's emulated USB controller in place.

Adds isochronous transfers, which UVC cameras use and the stock driver refuses, and an ACPI companion
for the controller: libcamera names a camera after the nearest parent that has a firmware node.
"""
import re
import sys

path = sys.argv[1]
with open(path) as file:
    source = file.read()


def put(old, new):
    """Replaces the first occurrence of a text that must be there."""
    global source
    if old not in source:
        sys.exit(f"dummy_hcd_iso.py: {path} is not as expected: no {old.strip()!r}; adapt the edits")
    source = source.replace(old, new, 1)


put("\tu32\t\t\tmiter_started;\n", "\tu32\t\t\tmiter_started;\n\tint\t\t\tiso_next;\n")
put("\turbp->miter_started = 0;\n", "\turbp->miter_started = 0;\n\turbp->iso_next = 0;\n")
put("\tunsigned long\t\t\tlast_io;\t/* jiffies timestamp */\n",
    "\tunsigned long\t\t\tlast_io;\t/* jiffies timestamp */\n\tu64\t\t\t\tiso_last;\t/* ns */\n")

DRIVE_BOTH_SIDES = """
/*
 * Drive both sides of the transfers; looks like irq handlers to both
"""
put(DRIVE_BOTH_SIDES, """
/*
 * One gadget request per (micro)frame interval, paced by the clock; an interval without a queued
 * request is an empty packet (IN) or a dropped one (OUT). Called with dum->lock held (dropped around
 * giveback).
 */
static void dummy_iso(struct dummy *dum, struct urb *urb, struct urbp *urbp,
\t\tstruct dummy_ep *ep, int *status)
{
\tu64 now = ktime_get_ns();
\tu64 ival = (u64)max(urb->interval, 1) *
\t\t(dum->gadget.speed >= USB_SPEED_HIGH ? 125000 : 1000000);
\tbool in = usb_urb_dir_in(urb);
\tint i;

\tif (!urb->transfer_buffer) {
\t\t*status = -EINVAL;
\t\treturn;
\t}
\tif (now - ep->iso_last > 512 * ival)
\t\tep->iso_last = now - ival;
\twhile (urbp->iso_next < urb->number_of_packets && now - ep->iso_last >= ival) {
\t\tstruct usb_iso_packet_descriptor *d = &urb->iso_frame_desc[urbp->iso_next++];
\t\tstruct dummy_request *req;
\t\tunsigned int len;

\t\tep->iso_last += ival;
\t\td->actual_length = 0;
\t\td->status = 0;
\t\treq = list_first_entry_or_null(&ep->queue, struct dummy_request, queue);
\t\tif (!req)
\t\t\tcontinue;
\t\tlen = min(req->req.length, d->length);
\t\tif (in) {
\t\t\tmemcpy(urb->transfer_buffer + d->offset, req->req.buf, len);
\t\t\tif (req->req.length > d->length)
\t\t\t\td->status = -EOVERFLOW;
\t\t} else {
\t\t\tmemcpy(req->req.buf, urb->transfer_buffer + d->offset, len);
\t\t}
\t\td->actual_length = len;
\t\treq->req.actual = len;
\t\treq->req.status = 0;
\t\tep->last_io = jiffies;
\t\tlist_del_init(&req->queue);
\t\tdummy_giveback(dum, &ep->ep, req);
\t}
\tif (urbp->iso_next >= urb->number_of_packets) {
\t\turb->actual_length = 0;
\t\turb->error_count = 0;
\t\tfor (i = 0; i < urb->number_of_packets; i++) {
\t\t\turb->actual_length += urb->iso_frame_desc[i].actual_length;
\t\t\tif (urb->iso_frame_desc[i].status)
\t\t\t\turb->error_count++;
\t\t}
\t\t*status = 0;
\t}
}
""" + DRIVE_BOTH_SIDES)

begin = source.index("\t\tcase PIPE_ISOCHRONOUS:\n")
end = source.index("\t\tcase PIPE_INTERRUPT:\n", begin)
source = (source[:begin] + "\t\tcase PIPE_ISOCHRONOUS:\n\t\t\tdummy_iso(dum, urb, urbp, ep, &status);\n"
          "\t\t\tbreak;\n\n" + source[end:])
# The isochronous end points are there, in a comment.
source = re.sub(r'/\*\n(\tEP_INFO\("ep\d+in-iso",\n.*?)\*/\n', r"\1", source, flags=re.S)

put("#include <linux/module.h>\n", "#include <linux/module.h>\n#include <linux/acpi.h>\n")
put("""\t\t\treturn retval;
\t\t}
\t}
\tfor (i = 0; i < mod_data.num; i++) {
\t\tthe_udc_pdev[i] =""", """\t\t\treturn retval;
\t\t}
#ifdef CONFIG_ACPI
\t\t{
\t\t\tacpi_handle h;

\t\t\tif (ACPI_SUCCESS(acpi_get_handle(NULL, "\\\\_SB.PCI0", &h)) ||
\t\t\t    ACPI_SUCCESS(acpi_get_handle(NULL, "\\\\_SB", &h)))
\t\t\t\tACPI_COMPANION_SET(&the_hcd_pdev[i]->dev, acpi_fetch_acpi_dev(h));
\t\t}
#endif
\t}
\tfor (i = 0; i < mod_data.num; i++) {
\t\tthe_udc_pdev[i] =""")

with open(path, "w") as file:
    file.write(source)

#!/usr/bin/env bash
# usage: build.sh CACHE   builds what the guest boots and prints the folder that holds it.
# Debian's stock kernel beside gpio-sim with interrupts, dummy_hcd with isochronous transfers and a UVC
# gadget with controls, all from Debian packages of which nothing is installed. CACHE keeps one folder
# for each kernel package version and state of these scripts; about a minute when it is not there yet.
set -euo pipefail
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
cache=$1
die() { echo "lab: $*" >&2; exit 1; }

# What suites may modprobe; whatever these need comes along.
modules=(virtio_pci virtio_mmio virtio_rng 9pnet_virtio 9p overlay
         gpio-sim dummy_hcd libcomposite usb_f_uvc usb_f_fs uvcvideo vivid)

find_kernel() {
  apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/.*Depends: linux-image-//p' | head -n 1
}
kernel=$(find_kernel)
if [ -z "$kernel" ]; then # package lists are often left out of images
  if [ "$(id -u)" -eq 0 ]; then apt-get -qq update || true; else sudo apt-get -qq update || true; fi
  kernel=$(find_kernel)
fi
[ -n "$kernel" ] || die "no linux-image-amd64 in the package lists: enable Debian's main archive, run apt-get update, try again"
version=$(apt-cache show "linux-image-$kernel" | sed -n 's/^Version: //p' | head -n 1)
scripts=$(cat "$here/build.sh" "$here/guest/init" "$here/dummy_hcd_iso.py" | sha256sum | cut -c1-8)
lab=$cache/$kernel-$version-$scripts
if [ -f "$lab/ready" ]; then echo "$lab"; exit; fi

echo "building the lab's guest ($lab)" >&2
mkdir -p "$cache"
work=$(mktemp -d "$cache/new.XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/{debs,root,source,modules,guest}

packages=("linux-image-$kernel" "linux-headers-$kernel" "linux-headers-${kernel%-amd64}-common"
          linux-kbuild-6.1 linux-compiler-gcc-12-x86)
(cd "$work/debs" && apt-get -qq download "${packages[@]}" 2>"$work/download.log") ||
  die "cannot download the kernel: $(tail -n 1 "$work/download.log"); run apt-get update and try again"
for deb in "$work"/debs/*.deb; do dpkg -x "$deb" "$work/root"; done

usb=linux-source-6.1/drivers/usb/gadget
tar xJf /usr/src/linux-source-6.1.tar.xz -C "$work/source" --strip-components=1 --wildcards \
  linux-source-6.1/drivers/gpio/{gpio-sim.c,gpiolib.h} linux-source-6.1/kernel/irq/irq_sim.c \
  $usb/udc/dummy_hcd.c $usb/function/{f_uvc.c,f_uvc.h,u_uvc.h} "$usb/function/uvc*" \
  linux-source-6.1/scripts/extract-vmlinux
cp "$work"/source/drivers/gpio/* "$work"/source/kernel/irq/irq_sim.c \
  "$work"/source/drivers/usb/gadget/udc/dummy_hcd.c "$work"/source/drivers/usb/gadget/function/* \
  "$work/modules"
cd "$work/modules"
# irq_sim is built in nowhere in the stock kernel, and not made to be a module.
sed -i '1i #include <linux/module.h>' irq_sim.c
echo 'MODULE_LICENSE("GPL");' >>irq_sim.c
sed -i 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq(irqnum)/' irq_sim.c
python3 "$here/dummy_hcd_iso.py" dummy_hcd.c
# The gadget offers automatic and absolute exposure (camera terminal) beside brightness and gain.
sed -i -E 's/(cd->bmControls\[0\]\s*=\s*)[^;]+;/\10x0a;/; s/(pd->bmControls\[1\]\s*=\s*)[^;]+;/\12;/' f_uvc.c
grep -q 'cd->bmControls\[0\].*0x0a;' f_uvc.c && grep -q 'pd->bmControls\[1\].*= 2;' f_uvc.c ||
  die "f_uvc.c is not as expected: adapt the edit of its bmControls in tests/lab/build.sh"
cat >Makefile <<'M'
obj-m := gpio-sim.o irq_sim.o dummy_hcd.o usb_f_uvc.o
usb_f_uvc-y := f_uvc.o uvc_queue.o uvc_v4l2.o uvc_video.o uvc_configfs.o
M
headers=$work/root/usr/src
echo "include $headers/linux-headers-${kernel%-amd64}-common/Makefile" >"$headers/linux-headers-$kernel/Makefile"
make -s -j"$(nproc)" -C "$headers/linux-headers-$kernel" M="$PWD" modules >"$work/modules.log" 2>&1 ||
  { tail -n 20 "$work/modules.log" >&2; die "the kernel modules could not be built"; }
strip -g ./*.ko
mkdir -p "$work/root/lib/modules/$kernel/updates"
cp ./*.ko "$work/root/lib/modules/$kernel/updates"
depmod -b "$work/root" "$kernel"

# The files of a module and of all it needs, in order.
needs() {
  modprobe -d "$work/root" -S "$kernel" --show-depends "$1" >"$work/needs" || die "the kernel has no module $1"
  awk '$1 == "insmod" { print $2 }' "$work/needs"
}
mkdir -p "$work/out/lib/modules/$kernel" "$work/guest"/{bin,dev,proc,sys,mods,root,lower,rw}
for module in "${modules[@]}"; do
  files=$(needs "$module")
  for file in $files; do
    to=$work/out${file#"$work/root"}
    mkdir -p "$(dirname "$to")"
    cp "$file" "$to"
  done
done
cp "$work/root/lib/modules/$kernel"/modules.{builtin,builtin.modinfo,order} "$work/out/lib/modules/$kernel"
depmod -b "$work/out" "$kernel"

cp /bin/busybox "$work/guest/bin/busybox"
ln -s busybox "$work/guest/bin/sh"
for module in virtio_pci virtio_mmio 9pnet_virtio 9p overlay; do
  files=$(needs "$module")
  for file in $files; do
    name=$(basename "$file")
    [ -e "$work/guest/mods/$name" ] || { cp "$file" "$work/guest/mods/"; echo "$name" >>"$work/guest/mods/order"; }
  done
done
install -m 755 "$here/guest/init" "$work/guest/init"
(cd "$work/guest" && find . | cpio -o -H newc --quiet) >"$work/out/initrd.cpio"
sh "$work/source/scripts/extract-vmlinux" "$work/root/boot/vmlinuz-$kernel" >"$work/out/vmlinux"
touch "$work/out/ready"
rm -rf "$lab"
mv "$work/out" "$lab"
echo "$lab"

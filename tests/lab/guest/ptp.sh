# Sourced by a suite: a still camera as a USB gadget on dummy_hcd, answered by lab_ptp through FunctionFS. Before
# it: $PTP_SCENE, the words of its scene (an array; empty: plain pictures).
#   $camera  the process     $PTP_GADGET  its configfs folder     ffs-camera.sent/N.jpg  the pictures that it sent
# Only the driver that is needed: the library reads all of them at every start.
mkdir camlibs iolibs
ln -s /usr/lib/*/libgphoto2/*/ptp2.so camlibs/
ln -s /usr/lib/*/libgphoto2_port/*/usb1.so iolibs/
export CAMLIBS=$PWD/camlibs IOLIBS=$PWD/iolibs
modprobe dummy_hcd is_high_speed=1 num=3
modprobe libcomposite
modprobe usb_f_fs
PTP_GADGET=/sys/kernel/config/usb_gadget/ptp
mkdir $PTP_GADGET $PTP_GADGET/strings/0x409 $PTP_GADGET/configs/c.1 $PTP_GADGET/functions/ffs.camera ffs-camera
echo 0x1d6b >$PTP_GADGET/idVendor
echo 0x0104 >$PTP_GADGET/idProduct
echo LAB0002 >$PTP_GADGET/strings/0x409/serialnumber
echo "Lab PTP Camera" >$PTP_GADGET/strings/0x409/product
ln -s $PTP_GADGET/functions/ffs.camera $PTP_GADGET/configs/c.1/
mount -t functionfs camera "$PWD/ffs-camera"
"$LAB_BIN/lab_ptp" "$PWD/ffs-camera" "${PTP_SCENE[@]}" >camera.log 2>&1 &
camera=$!
until grep -q "camera in" camera.log; do kill -0 $camera || { cat camera.log; exit 1; }; sleep 0.2; done
plug_camera() {
  echo dummy_udc.2 >$PTP_GADGET/UDC
  until grep -qs LAB0002 /sys/bus/usb/devices/*/serial; do sleep 0.2; done
  sleep 0.5
}
unplug_camera() { echo >$PTP_GADGET/UDC; }
plug_camera

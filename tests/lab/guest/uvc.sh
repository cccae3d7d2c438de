# Sourced by a suite: a UVC camera gadget on dummy_hcd that the guest's own uvcvideo sees; YUYV and MJPEG
# in three sizes. Its pictures come from whoever feeds the gadget's video node.
#   $UVC_GADGET  its configfs folder
modprobe dummy_hcd is_high_speed=1 num=3
modprobe uvcvideo
modprobe libcomposite
modprobe usb_f_uvc
UVC_GADGET=/sys/kernel/config/usb_gadget/camera
mkdir $UVC_GADGET
echo 0x1d6b >$UVC_GADGET/idVendor
echo 0x0102 >$UVC_GADGET/idProduct
echo 0x0100 >$UVC_GADGET/bcdDevice
mkdir $UVC_GADGET/strings/0x409
echo LAB0001 >$UVC_GADGET/strings/0x409/serialnumber
echo Lab >$UVC_GADGET/strings/0x409/manufacturer
echo "Lab UVC Camera" >$UVC_GADGET/strings/0x409/product
mkdir -p $UVC_GADGET/configs/c.1/strings/0x409
echo UVC >$UVC_GADGET/configs/c.1/strings/0x409/configuration
function=$UVC_GADGET/functions/uvc.0
mkdir $function
add_frame() { # FORMAT INDEX WIDTH HEIGHT
  local frame=$function/streaming/$1/$2
  mkdir -p "$frame"
  echo "$3" >"$frame/wWidth"
  echo "$4" >"$frame/wHeight"
  echo $(($3 * $4 * 2)) >"$frame/dwMaxVideoFrameBufferSize"
  echo 1000000 >"$frame/dwDefaultFrameInterval"
  # One write for all intervals, or the kernel keeps the last line only.
  /usr/bin/printf '333333\n666666\n1000000\n2000000\n5000000\n' >"$frame/dwFrameInterval"
}
for format in uncompressed/u mjpeg/m; do
  mkdir -p $function/streaming/$format
  add_frame $format 1 640 480
  add_frame $format 2 1280 720
  add_frame $format 3 1920 1080
done
mkdir $function/streaming/header/h
ln -s $function/streaming/uncompressed/u $function/streaming/header/h/u
ln -s $function/streaming/mjpeg/m $function/streaming/header/h/m
for speed in fs hs ss; do ln -s $function/streaming/header/h $function/streaming/class/$speed/h; done
mkdir $function/control/header/h
for speed in fs ss; do ln -s $function/control/header/h $function/control/class/$speed/h; done
echo 3072 >$function/streaming_maxpacket
echo ${UVC_INTERVAL:-1} >$function/streaming_interval # 2^(n-1) eighths of a millisecond a packet
ln -s $function $UVC_GADGET/configs/c.1/uvc.0
echo "${UVC_UDC:-dummy_udc.0}" >$UVC_GADGET/UDC
export UVC_GADGET

# Sourced by a suite: two Tic boards as USB gadgets on dummy_hcd, serial numbers LAB-T (turntable) and LAB-L
# (lift). A simulated board answers each through FunctionFS.
modprobe dummy_hcd is_high_speed=1 num=3
modprobe libcomposite
modprobe usb_f_fs
add_tic() { # NAME SERIAL UDC START
  local gadget=/sys/kernel/config/usb_gadget/$1 folder=$PWD/ffs-$1
  mkdir "$gadget" "$gadget/strings/0x409" "$gadget/configs/c.1" "$gadget/functions/ffs.$1" "$folder"
  echo 0x1ffb >"$gadget/idVendor"
  echo 0x00b3 >"$gadget/idProduct"
  echo 0x0107 >"$gadget/bcdDevice"
  echo "$2" >"$gadget/strings/0x409/serialnumber"
  echo "Tic T825" >"$gadget/strings/0x409/product"
  ln -s "$gadget/functions/ffs.$1" "$gadget/configs/c.1/"
  mount -t functionfs "$1" "$folder"
  "$LAB_BIN/lab_tic" "$folder" "$4" >"board-$1.log" 2>&1 &
  until grep -q "board in" "board-$1.log"; do sleep 0.2; done
  echo "$3" >"$gadget/UDC"
}
add_tic turntable LAB-T dummy_udc.0 400
add_tic lift LAB-L dummy_udc.1 -40

# Motion on two Tic boards through the kernel's USB stack: list, home, move, unplug and plug in again.
# limit: 600
. "$LAB_DIR/guest/tic.sh"
until [ "$("$LAB_BIN/lab_scanstation" device tic list | grep -c LAB-)" = 2 ]; do sleep 0.5; done
"$LAB_BIN/lab_scanstation" device tic list
"$LAB_BIN/lab_scanstation" device tic status --serial LAB-L
sed -e 's/00123456/LAB-T/; s/00123457/LAB-L/; s/driver = "v4l2"/driver = "sim"/' \
  "$LAB_DIR/../../configs/station-tic-uvc.toml" >tic.toml
"$LAB_BIN/lab_scanstation" doctor --config tic.toml
"$LAB_BIN/scanstation-motiond" --config tic.toml --socket "$PWD/motiond.sock" &
daemon=$!
until [ -S motiond.sock ]; do sleep 0.2; done
motion() { "$LAB_BIN/lab_scanstation" device motion "$@" --socket "$PWD/motiond.sock"; }
fails motion move --turntable-deg 10 --lift-mm 5
motion home
motion move --turntable-deg 30 --lift-mm 4
motion status | grep -q "30.000 deg counted"
motion status | grep -q "4.000 mm counted"
# The boards are held: nobody else mixes in.
fails "$LAB_BIN/lab_scanstation" device tic status --serial LAB-L
# Unplugged and plugged in again.
echo "" >/sys/kernel/config/usb_gadget/lift/UDC
sleep 2
motion status | grep -q "^lift *fault"
fails motion move --turntable-deg 40 --lift-mm 4
echo dummy_udc.1 >/sys/kernel/config/usb_gadget/lift/UDC
until "$LAB_BIN/lab_scanstation" device tic list | grep -q LAB-L; do sleep 0.5; done
motion home
motion move --turntable-deg 15 --lift-mm 2
motion status | grep -q "15.000 deg counted"
kill "$daemon"
wait "$daemon"

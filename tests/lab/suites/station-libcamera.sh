# The whole station: scanstationd captures 12 views through libgpiod and libcamera, with background plates.
# host: station station
# limit: 600
UVC_INTERVAL=4 # 3 MB/s are enough here, and the guest is busy with every packet
. "$LAB_DIR/guest/gpio.sh"
. "$LAB_DIR/guest/uvc.sh"
config=$PWD/station.toml
sed 's/^driver = "v4l2"/driver = "libcamera"/; s/^\[camera\.v4l2\]/[camera.libcamera]/; /^name = "Lab UVC/d
  s/^pixel_format = "MJPG"/pixel_format = "MJPEG"/' "$LAB_DIR/station.toml" >"$config"
grep -q '^\[camera.libcamera\]' "$config"
"$LAB_BIN/lab_scene" "$LAB_SCENE/station" /out/state -400 300 &
scene=$!
until grep -q "Lab UVC" /sys/class/video4linux/*/name; do sleep 0.2; done
. "$LAB_DIR/guest/udev.sh"
. "$LAB_DIR/guest/capture.sh"

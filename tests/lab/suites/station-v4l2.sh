# The whole station: scanstationd captures 12 views through libgpiod and V4L2, with background plates.
# host: station station
# limit: 600
UVC_INTERVAL=4 # 3 MB/s are enough here, and the guest is busy with every packet
. "$LAB_DIR/guest/gpio.sh"
. "$LAB_DIR/guest/uvc.sh"
config=$LAB_DIR/station.toml
"$LAB_BIN/lab_scene" "$LAB_SCENE/station" /out/state -400 300 &
scene=$!
. "$LAB_DIR/guest/capture.sh"

# The whole station: scanstationd captures 12 views through libgpiod and V4L2, with background plates.
# host: station
# limit: 400
# long
. "$LAB_DIR/guest/gpio.sh"
. "$LAB_DIR/guest/uvc.sh"
config=$LAB_DIR/station.toml
"$LAB_BIN/lab_scene" "$LAB_SCENE" state -400 300 &
scene=$!
until grep -q "Lab UVC" /sys/class/video4linux/*/name; do sleep 0.2; done
"$LAB_BIN/scanstation-motiond" --config "$config" --socket motiond.sock 2>motiond.log &
"$LAB_BIN/scanstationd" --config "$config" --socket daemon.sock --motion-socket motiond.sock --page-port -1 \
  2>/out/daemon.log &
until [ -S daemon.sock ]; do sleep 0.2; done
# The operator.
(
  for signal in USR1 USR2; do
    [ $signal = USR1 ] && asked=off || asked=back
    until "$LAB_BIN/scanstation" status --socket daemon.sock | grep -q "specimen $asked"; do sleep 0.5; done
    kill -$signal $scene
    sleep 1
    "$LAB_BIN/scanstation" confirm --socket daemon.sock
  done
) &
"$LAB_BIN/scanstation" capture --socket daemon.sock --out /out/session
"$LAB_BIN/scanstation" verify /out/session
kill %%

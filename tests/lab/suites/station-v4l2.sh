# The whole station: scanstationd captures 12 views through libgpiod and V4L2, with background plates.
# host: station
# limit: 600
UVC_INTERVAL=4 # 3 MB/s are enough here, and the guest is busy with every packet
. "$LAB_DIR/guest/gpio.sh"
. "$LAB_DIR/guest/uvc.sh"
config=$LAB_DIR/station.toml
"$LAB_BIN/lab_scene" "$LAB_SCENE" /out/state -400 300 &
scene=$!
until grep -q "Lab UVC" /sys/class/video4linux/*/name; do sleep 0.2; done
"$LAB_BIN/scanstation-motiond" --config "$config" --socket motiond.sock 2>motiond.log &
"$LAB_BIN/scanstationd" --config "$config" --socket daemon.sock --motion-socket motiond.sock --page-port 8380 \
  2>/out/daemon.log &
daemon=$!
until [ -S daemon.sock ]; do sleep 0.2; done

# The operator, at the station's page.
page() { # METHOD PATH
  exec 4<>/dev/tcp/127.0.0.1/8380
  printf '%s %s HTTP/1.0\r\nHost: 127.0.0.1\r\nContent-Length: 0\r\n\r\n' "$1" "$2" >&4
  cat <&4
  exec 4>&-
}
(
  for asked in remove:USR1 place:USR2; do
    until page GET /api/status | grep -q "\"question\":\"${asked%:*}\""; do sleep 0.5; done
    kill -"${asked#*:}" $scene
    sleep 0.5
    page POST '/api/answer?confirmed=yes' | grep -q '200 OK'
  done
) &
"$LAB_BIN/scanstation" capture --socket daemon.sock --out /out/session
"$LAB_BIN/scanstation" verify /out/session
kill $daemon
wait $daemon

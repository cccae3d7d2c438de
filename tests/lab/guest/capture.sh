# Sourced by a suite: the whole station captures into /out/session. Before it: $config, and $scene, the
# process that shows the specimen.
[ -z "${UVC_GADGET:-}" ] || until grep -q "Lab UVC" /sys/class/video4linux/*/name; do sleep 0.2; done
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
"$LAB_BIN/lab_scanstation" capture --socket daemon.sock --out /out/session
"$LAB_BIN/lab_scanstation" verify /out/session
kill $daemon
wait $daemon

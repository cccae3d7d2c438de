# A UVC camera through libcamera in its worker: contract in YUYV and MJPEG, controls, a worker that is killed
# in mid-capture, a camera that is gone.
# limit: 600
. "$LAB_DIR/guest/uvc.sh"
"$LAB_BIN/lab_uvc" &
feeder=$!
until grep -q "Lab UVC" /sys/class/video4linux/*/name; do sleep 0.2; done
. "$LAB_DIR/guest/udev.sh"
"$LAB_BIN/lab_scanstation" device libcamera list | tee list
grep -q "still YUYV.*640x480" list
grep -q "still MJPEG.*640x480" list
grep -q "control ExposureTime" list
"$LAB_BIN/lab_libcamera"
# What libcamera's metadata do not report is said, not assumed: of a UVC camera all but the time stamp.
"$LAB_BIN/lab_scanstation" device libcamera grab --size 640x480 --format MJPEG --exposure-us 9000 --set Brightness=0.2 \
  --out grab.jpg --json | tee grab.json
grep -q '"sensor_timestamp": true' grab.json
fails grep -q '"exposure_us"' grab.json
fails "$LAB_BIN/lab_scanstation" device libcamera grab --set NoSuchControl=1 --out no.jpg
"$LAB_BIN/lab_scanstation" device libcamera grab --size 640x480 --format MJPEG --count 12 --out many.jpg 2>many.log &
many=$!
until [ -f many-3.jpg ]; do sleep 0.05; done
pkill -KILL -f "$LAB_BIN/scanstation-camera-libcamera"
wait "$many"
cat many.log
grep -q "event=camera_worker_restart.*killed by signal 9" many.log
[ "$(ls many-*.jpg | wc -l)" -eq 12 ]
kill "$feeder"
wait "$feeder" || true
fails "$LAB_BIN/lab_scanstation" device libcamera grab --out gone.png 2>gone.log
cat gone.log
grep -q "the camera is not there" gone.log
fails pgrep -f "$LAB_BIN/scanstation-camera-libcamera"

# The V4L2 camera on a UVC camera: contract in YUYV and MJPEG, exposure, throughput, replugging.
# limit: 600
. "$LAB_DIR/guest/uvc.sh"
"$LAB_BIN/lab_uvc" &
feeder=$!
until grep -q "Lab UVC" /sys/class/video4linux/*/name; do sleep 0.2; done
"$LAB_BIN/lab_scanstation" device camera list
port=$("$LAB_BIN/lab_scanstation" device camera list --json | sed -n 's/.*"port": "\(dummy_hcd[^"]*\)".*/\1/p' | head -n 1)
export LAB_CAMERA=$port LAB_SIZE=640x480 LAB_FORMATS="MJPG YUYV" LAB_CYCLES=20
"$LAB_BIN/lab_v4l2" --gtest_filter='*CameraContract*:*KernelCamera*:*UsbCamera*:KernelCycles*'
"$LAB_BIN/lab_scanstation" device camera grab --port "$port" --format MJPG --size 1280x720 --out grab.jpg
"$LAB_BIN/lab_scanstation" device camera set --port "$port" brightness=-20 | grep -q -- -20
"$LAB_BIN/lab_scanstation" device camera controls --port "$port" | grep -q exposure_time_absolute
kill "$feeder"
wait "$feeder" || true
fails "$LAB_BIN/lab_scanstation" device camera grab --port "$port" --out gone.png

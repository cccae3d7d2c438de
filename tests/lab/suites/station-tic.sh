# The whole station on USB: scanstationd captures 12 views with two Tic boards and a UVC camera.
# host: station station-tic
# limit: 600
UVC_INTERVAL=4 UVC_UDC=dummy_udc.2
. "$LAB_DIR/guest/tic.sh"
. "$LAB_DIR/guest/uvc.sh"
config=$LAB_DIR/station-tic.toml
"$LAB_BIN/lab_scene" "$LAB_SCENE/station-tic" ffs-turntable.place ffs-lift.place &
scene=$!
. "$LAB_DIR/guest/capture.sh"

# The whole station: scanstationd captures 12 views through libgpiod and a tethered camera, with background
# plates.
# host: station station
# limit: 600
. "$LAB_DIR/guest/gpio.sh"
config=$PWD/station.toml # the lab's station with another camera
sed -e '/^\[\[camera\]\]/,/^$/s/^driver = .*/driver = "ptp"/' \
  -e 's/^\[camera.lens\]/[camera.ptp]\nserial = "LAB0002"\ntarget = "card"\ndelete_from_card = true\n\n&/' \
  "$LAB_DIR/station.toml" >"$config"
PTP_SCENE=("$LAB_SCENE/station" /out/state -400 300)
. "$LAB_DIR/guest/ptp.sh"
scene=$camera
. "$LAB_DIR/guest/capture.sh"

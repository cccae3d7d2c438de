# The tethered camera through libgphoto2 in its worker: found, set, released, unplugged, hung.
# limit: 600
PTP_SCENE=()
. "$LAB_DIR/guest/ptp.sh"
ptp() { "$LAB_BIN/lab_scanstation" device ptp "$@"; }
ptp list
ptp list --json | grep -q '"serial LAB0002"'
port=$(ptp list --json | sed -n 's/.*"port": "\([^"]*\)".*/\1/p')
ptp info --port "$port" --json | tee info.json
grep -q '"battery_percent": 80' info.json
grep -q '"shots_left": 500' info.json
ptp get --port "$port" shutterspeed iso
ptp set --port "$port" iso=400 | grep -q 'iso = 400'

# Settings set and held, pictures byte for byte.
grab() { ptp grab --port "$port" --size 320x240 "$@"; }
sent() { # FILE...   every one is a picture that the camera sent, no two the same
  for file; do
    known=
    for picture in ffs-camera.sent/*.jpg; do ! cmp -s "$file" "$picture" || known=$picture; done
    [ "$known" ]
  done
  [ "$(sha256sum "$@" | cut -c1-64 | sort -u | wc -l)" -eq $# ]
}
grab --exposure-us 4000 --gain 2 --count 3 --out a.jpg --json >a.json
grep -q '"exposure_us": 4000' a.json
grep -q '"gain": 2' a.json
sent a-{1..3}.jpg
fails grab --exposure-us 5000 --out none.jpg 2>refused
grep -q '4000 us' refused

# Unplugged and plugged in again in the middle of a run.
grab --exposure-us 8000 --count 6 --out b.jpg &
run=$!
until [ -e b-2.jpg ]; do sleep 0.1; done
unplug_camera
sleep 1
plug_camera
wait $run
sent b-{1..6}.jpg

# A worker that hangs is killed, the camera reset before the last attempt; the run goes on.
grab --exposure-us 8000 --count 6 --out c.jpg 2>c.log &
run=$!
until [ -e c-2.jpg ]; do sleep 0.1; done
for time in first second; do
  worker=$(pgrep -n -f scanstation-camera-ptp)
  kill -STOP "$worker"
  while kill -0 "$worker" 2>/dev/null; do sleep 0.2; done
done
wait $run
sent c-{1..6}.jpg
cat c.log

# Gone for good: a clear fault.
unplug_camera
fails grab --out gone.jpg 2>gone
cat gone
grep -q "no such still camera" gone

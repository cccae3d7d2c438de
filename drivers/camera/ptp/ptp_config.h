// The PTP part of a camera's configuration, as its station file says it ([camera.ptp]).
#pragma once

#include <map>
#include <string>

namespace scan {

struct PtpConfig {
  std::string port;                 // where it is plugged in ("1-2.3"); empty: any
  std::string serial;               // of the USB device; empty: any
  std::string model;                // as 'device ptp list' calls it; empty: any
  std::string target = "ram";       // ram card: where the camera keeps the picture
  std::string quality;              // entry of imagequality or imageformat; empty: as it is
  double f_number = 0;              // 0: as it is
  double base_iso = 100;            // the ISO speed that is gain 1; 0: ISO is not driven
  int files = 0;                    // of one exposure; 0: two where the quality has a '+'
  bool delete_from_card = false;    // once they are downloaded; never files of other exposures
  bool manual_focus = true;         // anything else is a fault
  double min_battery_percent = 20;  // below it no run begins
  int min_shots = 20;               // room on the card, below it no run begins
  double settings_ms = 2000;        // for a setting to be taken over
  double picture_ms = 20000;        // from the end of the exposure to the first file
  double pair_ms = 10000;           // from the first file to the second
  double reconnect_ms = 5000;       // how long a camera that is gone is waited for
  std::string gpio_chip;            // of the two lines; empty: the one that has them
  std::string release_line;         // closes the camera's wired release; empty: over USB
  bool release_active_low = false;  //
  double release_ms = 200;          // pressed so long
  std::string hot_shoe_line;        // the flash contact, bias up: active when closed; empty: none
  bool hot_shoe_active_low = true;  //
  double curtain_ms = 5;            // of the shutter, opening or closing
  std::map<std::string, std::string> settings;  // further ones by name, held at every frame
  friend bool operator==(const PtpConfig&, const PtpConfig&) = default;
};

}  // namespace scan

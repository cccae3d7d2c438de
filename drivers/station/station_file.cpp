#include "drivers/station/station_file.h"

#include <fmt/format.h>

#include <cmath>

#include "drivers/base/files.h"
#include "drivers/station/toml_reader.h"

namespace scan {
namespace {

constexpr double kFar = 1e5;  // mm or degrees: beyond any station

void ReadHoming(TomlReader& in, HomingConfig& homing) {
  if (const auto kind = in.Word("kind", {"endstop", "index"})) {
    homing.kind = *kind == 0 ? HomingKind::endstop : HomingKind::index;
  }
  if (const auto word = in.Word("direction", {"positive", "negative"})) {
    homing.direction = *word == 0 ? 1 : -1;
  }
  in.Number("position", homing.position, -kFar, kFar);
  in.Number("fast", homing.fast, 1e-3, 1e4);
  in.Number("slow", homing.slow, 1e-3, 1e4);
  in.Number("back_off", homing.back_off, 1e-3, 1e3);
  in.Number("max_travel", homing.max_travel, 1e-3, kFar);
  in.Integer("repeat_steps", homing.repeat_steps, 0, 10'000);
}

void ReadPin(TomlReader& in, const char* key, GpioPin& pin) {
  std::string text;
  in.Text(key, text);
  if (text.empty()) return;
  if (const auto parsed = ParseGpioPin(text)) {
    pin = *parsed;
  } else {
    in.RefuseValue(key, parsed.error().what, parsed.error().mend);
  }
}

void ReadWiring(TomlReader& in, GpioAxisWiring& wiring) {
  ReadPin(in, "step", wiring.step);
  ReadPin(in, "direction", wiring.direction);
  ReadPin(in, "enable", wiring.enable);
  ReadPin(in, "brake", wiring.brake);
  ReadPin(in, "endstop", wiring.endstop);
  ReadPin(in, "index", wiring.index);
  in.Number("pulse_us", wiring.pulse_us, 0, 1000);
  in.Number("setup_us", wiring.setup_us, 0, 10'000);
  in.Number("enable_ms", wiring.enable_ms, 0, 1000);
}

void ReadLight(TomlReader& in, LightConfig& light) {
  if (const auto word = in.Word("driver", {"none", "gpio", "pwm"})) {
    light.driver = static_cast<LightDriver>(*word);
  }
  in.Text("chip", light.chip);
  ReadPin(in, "line", light.line);
  in.Integer("channel", light.channel, 0, 255);
  in.Flag("active_low", light.active_low);
  in.Number("period_us", light.period_us, 1, 1e6);
  in.Number("level", light.level, 0.001, 1);
  in.Number("settle_ms", light.settle_ms, 0, kMaxSettleMs);
}

void ReadTic(TomlReader& in, TicAxisWiring& wiring) {
  in.Text("serial", wiring.serial);
  in.Text("port", wiring.port);
  in.Integer("microsteps", wiring.microsteps, 0, 256);
}

void ReadTmc2209(TomlReader& in, Tmc2209Config& config) {
  in.Text("port", config.port);
  in.Integer("address", config.address, 0, 3);
  in.Integer("microsteps", config.microsteps, 1, 256);
  in.Number("run_ma", config.run_ma, 1, 3000);
  in.Number("hold_ma", config.hold_ma, 0, 3000);
  in.Number("sense_mohm", config.sense_mohm, 10, 1000);
  in.Flag("stealth_chop", config.stealth_chop);
  in.Integer("stall_threshold", config.stall_threshold, 0, 255);
}

void ReadMotion(TomlReader& in, StationConfig& config) {
  if (const auto word = in.Word("driver", {"sim", "gpio", "tic"})) {
    config.motion_driver = static_cast<MotionDriver>(*word);
  }
  in.Number("poll_ms", config.tic.poll_ms, 1, 100);
  in.Text("chip", config.gpio.chip);
  ReadPin(in, "emergency_stop", config.gpio.emergency_stop);
  ReadPin(in, "cover", config.gpio.cover);
  ReadPin(in, "motor_power", config.gpio.motor_power);
  in.Number("power_off_ms", config.gpio.power_off_ms, 1, 10'000);
  in.Integer("priority", config.gpio.real_time.priority, 0, 99);
  int core = -1;
  in.Integer("core", core, -1, 1023);
  if (core >= 0) config.gpio.real_time.core = core;
}

void ReadAxis(TomlReader& in, AxisConfig& axis) {
  in.Number("steps_per_unit", axis.steps_per_unit, 1e-3, 1e6);
  if (const auto word = in.Word("positive_steps", {"forward", "backward"})) {
    axis.sign = *word == 0 ? 1 : -1;
  }
  in.Number("min", axis.min, -kFar, kFar);
  in.Number("max", axis.max, -kFar, kFar);
  in.Number("velocity", axis.velocity, 1e-3, 1e4);
  in.Number("acceleration", axis.acceleration, 1e-3, 1e5);
  in.Number("self_start", axis.self_start, 1e-3, 1e4);
  in.Number("backlash", axis.backlash, 0, 10);
  if (const auto word = in.Word("approach", {"positive", "negative"})) {
    axis.approach = *word == 0 ? 1 : -1;
  }
  double settle_ms = static_cast<double>(axis.settle_ns) * 1e-6;
  in.Number("settle_ms", settle_ms, 0, 60'000);
  axis.settle_ns = std::llround(settle_ms * 1e6);
  if (const auto word = in.Word("on_stop", {"release", "hold", "brake"})) {
    axis.on_stop = static_cast<OnStop>(*word);
  }
  in.Flag("self_locking", axis.self_locking);
  in.Number("sigma_shared", axis.sigma_shared, 0, 10);
  in.Number("sigma_view", axis.sigma_view, 0, 10);
  in.Table("homing", [&](TomlReader& homing) { ReadHoming(homing, axis.homing); });
}

void ReadLens(TomlReader& in, LensConfig& lens) {
  in.Number("focal_mm", lens.focal_mm, 1, 1000);
  in.Number("sensor_width_mm", lens.sensor_width_mm, 1, 100);
  in.Number("k1", lens.k1, -2, 2);
  in.Number("k2", lens.k2, -10, 10);
  in.Number("p1", lens.p1, -0.1, 0.1);
  in.Number("p2", lens.p2, -0.1, 0.1);
  in.Number("k3", lens.k3, -50, 50);
}

void ReadV4l2(TomlReader& in, V4l2Config& v4l2) {
  in.Text("port", v4l2.port);
  in.Text("name", v4l2.name);
  in.Text("pixel_format", v4l2.pixel_format);
  in.Number("frame_interval_ms", v4l2.frame_interval_ms, 0, 60'000);
  in.Flag("lock_automatics", v4l2.lock_automatics);
  in.Number("unity_gain", v4l2.unity_gain, 0, 65'536);
  in.Integer("latency_frames", v4l2.latency_frames, 0, 16);
  in.Integer("settings_frames", v4l2.settings_frames, 0, 16);
  in.Number("timeout_ms", v4l2.timeout_ms, 100, 60'000);
  in.Number("reconnect_ms", v4l2.reconnect_ms, 0, 600'000);
  in.Table("controls", [&](TomlReader& controls) { controls.Scalars(v4l2.controls); });
}

void ReadLibcamera(TomlReader& in, LibcameraConfig& libcamera) {
  in.Text("camera", libcamera.camera);
  const char* const roles[] = {"still", "viewfinder", "raw"};
  if (const auto word = in.Word("role", {"still", "viewfinder", "raw"}))
    libcamera.role = roles[static_cast<std::size_t>(*word)];
  in.Text("pixel_format", libcamera.pixel_format);
  in.Flag("lock_automatics", libcamera.lock_automatics);
  in.Integer("latency_frames", libcamera.latency_frames, 0, 16);
  in.Integer("settings_frames", libcamera.settings_frames, 0, 16);
  in.Number("timeout_ms", libcamera.timeout_ms, 100, 60'000);
  in.Number("reconnect_ms", libcamera.reconnect_ms, 0, 600'000);
  in.Table("controls", [&](TomlReader& controls) { controls.Scalars(libcamera.controls); });
}

void ReadPtp(TomlReader& in, PtpConfig& ptp) {
  in.Text("port", ptp.port);
  in.Text("serial", ptp.serial);
  in.Text("model", ptp.model);
  const std::vector<std::string> targets{"ram", "card"};
  if (const auto word = in.Word("target", targets)) ptp.target = targets[*word];
  in.Text("quality", ptp.quality);
  in.Number("f_number", ptp.f_number, 0, 64);
  in.Number("base_iso", ptp.base_iso, 0, 102'400);
  in.Integer("files", ptp.files, 0, 2);
  in.Flag("delete_from_card", ptp.delete_from_card);
  in.Flag("manual_focus", ptp.manual_focus);
  in.Number("min_battery_percent", ptp.min_battery_percent, 0, 100);
  in.Integer("min_shots", ptp.min_shots, 0, 100'000);
  in.Number("settings_ms", ptp.settings_ms, 100, 60'000);
  in.Number("picture_ms", ptp.picture_ms, 1000, 600'000);
  in.Number("pair_ms", ptp.pair_ms, 100, 600'000);
  in.Number("reconnect_ms", ptp.reconnect_ms, 0, 600'000);
  in.Text("gpio_chip", ptp.gpio_chip);
  in.Text("release_line", ptp.release_line);
  in.Flag("release_active_low", ptp.release_active_low);
  in.Number("release_ms", ptp.release_ms, 10, 10'000);
  in.Text("hot_shoe_line", ptp.hot_shoe_line);
  in.Flag("hot_shoe_active_low", ptp.hot_shoe_active_low);
  in.Number("curtain_ms", ptp.curtain_ms, 0, 100);
  in.Table("settings", [&](TomlReader& settings) { settings.Scalars(ptp.settings); });
}

CameraConfig ReadCamera(TomlReader& in) {
  CameraConfig camera = DefaultSimStation().cameras.front();
  in.Text("id", camera.id);
  in.Text("model", camera.model);
  if (const auto word = in.Word("driver", {"sim", "v4l2", "libcamera", "ptp"})) {
    camera.driver = static_cast<CameraDriver>(*word);
  }
  in.Table("v4l2", [&](TomlReader& v4l2) { ReadV4l2(v4l2, camera.v4l2); });
  in.Table("libcamera", [&](TomlReader& libcamera) { ReadLibcamera(libcamera, camera.libcamera); });
  in.Table("ptp", [&](TomlReader& ptp) { ReadPtp(ptp, camera.ptp); });
  in.Integer("width_px", camera.w, 16, 20'000);
  in.Integer("height_px", camera.h, 16, 20'000);
  in.Number("azimuth_deg", camera.azimuth_deg, -360, 360);
  in.Number("exposure_us", camera.exposure_us, 1, 10e6);
  in.Number("gain", camera.gain, 1, 64);
  in.Number("sigma_focal_rel", camera.sigma_fl_rel, 0, 0.5);
  in.Number("sigma_principal_point_px", camera.sigma_c_px, 0, 1000);
  in.Number("sigma_rotation_deg", camera.sigma_rotation_deg, 0, 90);
  in.Number("sigma_translation_mm", camera.sigma_translation_mm, 0, 1000);
  in.Table("lens", [&](TomlReader& lens) { ReadLens(lens, camera.lens); });
  return camera;
}

AimConfig ReadAim(TomlReader& in) {
  AimConfig aim;
  in.Text("id", aim.id);
  in.Number("elevation_deg", aim.elevation_deg, -89, 89);
  in.Number("lift_mm", aim.lift_mm, -kFar, kFar);
  in.Number("look_at_mm", aim.look_at_mm, -1000, 1000);
  in.Number("distance_mm", aim.distance_mm, 10, 10'000);
  return aim;
}

RingConfig ReadRing(TomlReader& in) {
  RingConfig ring;
  in.Text("aim", ring.aim);
  in.Integer("count", ring.count, 1, 3600);
  in.Number("start_deg", ring.start_deg, -3600, 3600);
  return ring;
}

void ReadErrors(TomlReader& in, SimErrors& errors) {
  if (const auto word = in.Word("level", {"ideal", "static", "dynamic"})) {
    errors = DefaultSimErrors(static_cast<ErrorLevel>(*word));
  }
  in.Number("focal_rel", errors.focal_rel, 0, 0.5);
  in.Number("principal_point_px", errors.principal_point_px, 0, 1000);
  in.Number("runout_mm", errors.runout_mm, 0, 10);
  in.Number("axis_tilt_deg", errors.axis_tilt_deg, 0, 30);
  in.Number("backlash_deg", errors.backlash_deg, 0, 10);
  in.Number("backlash_mm", errors.backlash_mm, 0, 10);
  in.Number("lift_scale_rel", errors.lift_scale_rel, 0, 0.5);
  in.Number("aim_rotation_deg", errors.aim_rotation_deg, 0, 30);
  in.Number("aim_translation_mm", errors.aim_translation_mm, 0, 100);
  in.Number("homing_offset_deg", errors.homing_offset_deg, 0, 30);
  in.Number("homing_offset_mm", errors.homing_offset_mm, 0, 100);
  in.Number("view_sigma_deg", errors.view_sigma_deg, 0, 30);
  in.Number("view_sigma_mm", errors.view_sigma_mm, 0, 100);
  in.Number("vibration_deg", errors.vibration_deg, 0, 10);
  in.Number("vibration_decay_s", errors.vibration_decay_s, 1e-3, 10);
  in.Integer("late_frames", errors.late_frames, 0, 1000);
}

LostSteps ReadLostSteps(TomlReader& in) {
  LostSteps lost;
  in.Text("axis", lost.axis);
  in.Integer("after_steps", lost.after_steps, 0, 1'000'000'000);
  in.Integer("count", lost.count, 0, 1'000'000);
  return lost;
}

void ReadPlacement(TomlReader& in, PlacementConfig& placement) {
  in.Number("yaw_deg", placement.yaw_deg, -360, 360);
  in.Number("tilt_deg", placement.tilt_deg, -180, 180);
  in.Number("tilt_axis_deg", placement.tilt_axis_deg, -360, 360);
  in.Vector3("offset_mm", placement.offset_mm.data(), -1000, 1000);
  in.Vector3("pivot_in_model_mm", placement.pivot_in_model_mm.data(), -1000, 1000);
}

void ReadSim(TomlReader& in, SimConfig& sim) {
  auto seed = static_cast<std::int64_t>(sim.seed);
  in.Integer("seed", seed, 0, INT64_MAX);
  sim.seed = static_cast<std::uint64_t>(seed);
  in.Text("specimen", sim.specimen);
  in.Number("noise", sim.noise, 0, 50);
  const std::vector<std::string> formats{"jpg", "png"};
  if (const auto word = in.Word("format", formats)) sim.format = formats[*word];
  in.Integer("jpeg_quality", sim.jpeg_quality, 1, 100);
  in.Integer("settings_delay_frames", sim.settings_delay_frames, 0, 16);
  in.Number("frame_interval_ms", sim.frame_interval_ms, 1, 60'000);
  in.Table("errors", [&](TomlReader& errors) { ReadErrors(errors, sim.errors); });
  in.Tables("lost_steps", sim.lost_steps, ReadLostSteps);
  in.Table("placement", [&](TomlReader& placement) { ReadPlacement(placement, sim.placement); });
}

void ReadAxes(TomlReader& in, StationConfig& config) {
  in.Table("turntable", [&](TomlReader& axis) {
    ReadAxis(axis, config.turntable);
    axis.Table("gpio", [&](TomlReader& gpio) { ReadWiring(gpio, config.gpio.turntable); });
    axis.Table("tic", [&](TomlReader& tic) { ReadTic(tic, config.tic.turntable); });
    axis.Table("tmc2209", [&](TomlReader& tmc) { ReadTmc2209(tmc, config.turntable_tmc2209); });
  });
  in.Table("lift", [&](TomlReader& axis) {
    ReadAxis(axis, config.lift);
    axis.Table("gpio", [&](TomlReader& gpio) { ReadWiring(gpio, config.gpio.lift); });
    axis.Table("tic", [&](TomlReader& tic) { ReadTic(tic, config.tic.lift); });
    axis.Table("tmc2209", [&](TomlReader& tmc) { ReadTmc2209(tmc, config.lift_tmc2209); });
    const std::vector<std::string> kinds{"fixed_pitch", "manual_aim", "arc", "pitch_axis"};
    if (const auto word = axis.Word("kind", kinds)) config.lift_geometry.kind = kinds[*word];
    axis.Vector3("direction_in_station", config.lift_geometry.direction_in_station.data(), -1, 1);
  });
}

// The line of the nearest table or key that the text has on the way to `key`.
std::uint32_t LineOf(const toml::table& root, std::string_view key) {
  const toml::node* at = &root;
  while (!key.empty()) {
    const std::size_t dot = key.find('.');
    const toml::table* table = at->as_table();
    const toml::node* next = table ? table->get(key.substr(0, dot)) : nullptr;
    if (!next) break;
    at = next;
    key = dot == std::string_view::npos ? std::string_view() : key.substr(dot + 1);
  }
  return std::max<std::uint32_t>(1, at->source().begin.line);
}

}  // namespace

Result<StationConfig> ParseStationConfig(std::string_view text, const std::string& source) {
  toml::table root;
  try {
    root = toml::parse(text, source);
  } catch (const toml::parse_error& e) {
    return BadInput(std::string(e.description()),
                    fmt::format("{}:{}", source, e.source().begin.line), "correct the TOML syntax");
  }
  StationConfig config = DefaultSimStation();
  std::optional<Error> error;
  TomlReader in(root, source, "", error);
  in.Text("name", config.name);
  in.Table("motion", [&](TomlReader& motion) { ReadMotion(motion, config); });
  in.Table("light", [&](TomlReader& light) { ReadLight(light, config.light); });
  in.Table("axis", [&](TomlReader& axes) { ReadAxes(axes, config); });
  in.Tables("camera", config.cameras, ReadCamera);
  in.Tables("aim", config.aims, ReadAim);
  in.Table("plan", [&](TomlReader& plan) { plan.Tables("rings", config.plan.rings, ReadRing); });
  in.Table("sim", [&](TomlReader& sim) { ReadSim(sim, config.sim); });
  in.RefuseUnknown();
  if (error) return tl::unexpected(*error);
  if (Status valid = Validate(config); !valid) {
    Error whole = valid.error();
    whole.what = fmt::format("{}: {}", whole.where, whole.what);
    whole.where = fmt::format("{}:{}", source, LineOf(root, valid.error().where));
    return tl::unexpected(whole);
  }
  return config;
}

Result<StationConfig> LoadStationConfig(const std::filesystem::path& path) {
  auto text = ReadTextFile(path);
  if (!text) {
    Error error = text.error();
    error.kind = ErrorKind::bad_input;
    return tl::unexpected(error);
  }
  return ParseStationConfig(*text, path.string());
}

}  // namespace scan

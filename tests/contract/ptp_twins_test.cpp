// The PTP camera on simulated DSLRs under the contract suite.
#include "tests/contract/twin.h"
#include "tests/support/ptp_bench.h"

namespace scan {
namespace {

TwinFactory<Camera> Factory(std::string name, DslrKind kind, std::string quality, bool lines) {
  return {std::move(name), [kind, quality, lines] {
            PtpCameraOptions options;
            options.config.quality = quality;
            auto bench = std::make_shared<PtpBench>(kind, options);
            Twin<Camera> twin;
            const Status opened = bench->Open(lines ? bench->dslr->Lines() : nullptr);
            EXPECT_TRUE(opened) << ToString(opened.error());
            twin.clock = bench->clock;
            twin.activity = bench->clock.get();
            twin.device = std::move(bench->camera);
            twin.world = bench;
            return twin;
          }};
}

INSTANTIATE_TEST_SUITE_P(PtpSimulated, CameraContract,
                         ::testing::Values(Factory("nikon", DslrKind::nikon, "NEF+Fine", false),
                                           Factory("canon", DslrKind::canon, "L", false),
                                           Factory("plain", DslrKind::plain, "", false),
                                           Factory("lines", DslrKind::nikon, "JPEG Fine", true)),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan

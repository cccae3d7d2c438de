// Cameras in a process of their own under the contract suite.
#include "tests/contract/twin.h"
#include "tests/support/worker_bench.h"

namespace scan {
namespace {

TwinFactory<Camera> Factory(std::string name, std::function<CameraWorkerLauncher()> launcher) {
  return {std::move(name), [launcher] {
            Twin<Camera> twin;
            twin.clock = std::make_shared<SystemClock>();
            WorkerCameraOptions options;
            options.id = "c0";
            options.options = Written({});
            auto camera = WorkerCamera::Open(options, launcher());
            EXPECT_TRUE(camera) << ToString(camera.error());
            if (camera) twin.device = std::move(*camera);
            return twin;
          }};
}

CameraWorkerLauncher OnAThread() {
  return ThreadProgram([](UniqueFd socket) { ServeCamera(std::move(socket), ScriptedRole()); });
}

INSTANTIATE_TEST_SUITE_P(Worker, CameraContract,
                         ::testing::Values(Factory("process", TestWorkerProgram),
                                           Factory("thread", OnAThread)),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace scan

// A worker program that hosts the simulated camera.
#include "tests/support/worker_bench.h"

int main() { return scan::CameraWorkerMain(scan::ScriptedRole(), "camera_test_worker"); }

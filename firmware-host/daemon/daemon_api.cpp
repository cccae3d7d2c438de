#include "firmware-host/daemon/daemon_api.h"

namespace scan {
namespace {

Result<Json> Done(const Status& status) {
  SCAN_CHECK(status);
  return Json::object();
}

}  // namespace

RpcFunctions DaemonFunctions(CaptureService& service, OperatorPrompt& operator_prompt,
                             RequestMaker make_request, std::function<void()> on_shutdown) {
  RpcFunctions functions;
  functions["capture"] = {
      [&service, make_request](const Json& params, std::stop_token) -> Result<Json> {
        SCAN_TRY(CaptureRequest request, make_request(params));
        return Done(service.Start(std::move(request)));
      }};
  functions["stop"] = {[&service](const Json&, std::stop_token) -> Result<Json> {
    service.Stop();
    return Json::object();
  }};
  functions["pause"] = {[&service](const Json&, std::stop_token) { return Done(service.Pause()); }};
  functions["resume"] = {
      [&service](const Json&, std::stop_token) { return Done(service.Resume()); }};
  functions["answer"] = {[&operator_prompt](const Json& params, std::stop_token) {
    return Done(operator_prompt.Answer(
        {.confirmed = params.value("confirmed", true), .note = params.value("note", "")}));
  }};
  functions["status"] = {
      [&service](const Json&, std::stop_token) -> Result<Json> { return service.ReadStatus(); }};
  functions["shutdown"] = {[on_shutdown](const Json&, std::stop_token) -> Result<Json> {
    on_shutdown();
    return Json::object();
  }};
  return functions;
}

}  // namespace scan

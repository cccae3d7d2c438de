#include "firmware-host/daemon/page.h"

#include <httplib.h>

#include <thread>

#include "drivers/base/files.h"
#include "page_html.h"

namespace scan {
namespace {

bool IsLoopbackName(std::string host) {
  if (const auto colon = host.rfind(':'); colon != std::string::npos) host.resize(colon);
  return host == "127.0.0.1" || host == "localhost";
}

std::string MimeOf(const std::filesystem::path& picture) {
  const std::string extension = picture.extension().string();
  if (extension == ".png") return "image/png";
  return "image/jpeg";
}

}  // namespace

struct Page::Impl {
  httplib::Server server;
  PageBackend backend;
  int port = 0;
  std::thread thread;
};

Page::Page(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Page::~Page() {
  while (!impl_->server.is_running()) std::this_thread::yield();  // stop() before that is lost
  impl_->server.stop();
  impl_->thread.join();
}

int Page::port() const { return impl_->port; }

Result<std::unique_ptr<Page>> Page::Start(int port, PageBackend backend) {
  auto impl = std::make_unique<Impl>();
  impl->backend = std::move(backend);
  httplib::Server& server = impl->server;
  server.new_task_queue = [] { return new httplib::ThreadPool(4); };
  server.set_payload_max_length(4096);
  // Not the library's SO_REUSEPORT, which lets two daemons share one port, each seeing some calls.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
    // A page of another origin may neither read nor post: its Origin header gives it away.
    const bool foreign =
        request.has_header("Origin") &&
        request.get_header_value("Origin") != "http://" + request.get_header_value("Host");
    if (IsLoopbackName(request.get_header_value("Host")) && !foreign)
      return httplib::Server::HandlerResponse::Unhandled;
    response.status = 403;
    return httplib::Server::HandlerResponse::Handled;
  });
  server.Get("/", [](const httplib::Request&, httplib::Response& response) {
    response.set_content(kPageHtml, "text/html; charset=utf-8");
  });
  server.Get("/api/status",
             [raw = impl.get()](const httplib::Request&, httplib::Response& response) {
               response.set_content(raw->backend.status().dump(), "application/json");
             });
  server.Get("/api/picture",
             [raw = impl.get()](const httplib::Request&, httplib::Response& response) {
               const auto path = raw->backend.last_picture();
               const auto bytes = path.empty() ? Result<std::string>("") : ReadTextFile(path);
               if (!bytes || bytes->empty()) {
                 response.status = 404;
                 return;
               }
               response.set_content(*bytes, MimeOf(path).c_str());
             });
  server.Post("/api/stop",
              [raw = impl.get()](const httplib::Request&, httplib::Response& response) {
                raw->backend.stop();
                response.set_content("{}", "application/json");
              });
  server.Post("/api/answer", [raw = impl.get()](const httplib::Request& request,
                                                httplib::Response& response) {
    const auto answered = raw->backend.answer(request.get_param_value("confirmed") != "no");
    if (!answered) response.status = 409;
    response.set_content("{}", "application/json");
  });
  impl->port = port == 0 ? server.bind_to_any_port("127.0.0.1")
                         : (server.bind_to_port("127.0.0.1", port) ? port : -1);
  if (impl->port <= 0)
    return BadInput("the page's port is taken", "127.0.0.1:" + std::to_string(port),
                    "free it or give scanstationd another --page-port");
  impl->thread = std::thread([raw = impl.get()] { raw->server.listen_after_bind(); });
  return std::unique_ptr<Page>(new Page(std::move(impl)));
}

}  // namespace scan

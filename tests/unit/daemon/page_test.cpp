#include "firmware-host/daemon/page.h"

#include <gtest/gtest.h>
#include <httplib.h>

#include <atomic>

#include "drivers/base/files.h"
#include "tests/support/temp_folder.h"

namespace scan {
namespace {

class LoopbackPage : public ::testing::Test {
 protected:
  void SetUp() override {
    page_ = std::move(Page::Start(0, {[] {
                                        return nlohmann::json{{"state", "capturing"}};
                                      },
                                      [this] { ++stops_; },
                                      [this](bool confirmed) -> Status {
                                        if (!asked_) return BadInput("nothing is asked", "", "");
                                        answers_ += confirmed ? 'y' : 'n';
                                        return {};
                                      },
                                      [this] { return last_picture_; }}))
                .value();
    client_ = std::make_unique<httplib::Client>("127.0.0.1", page_->port());
  }
  httplib::Result Get(const std::string& path, const httplib::Headers& headers = {}) {
    return client_->Get(path, headers);
  }

  TempFolder folder_;
  std::filesystem::path last_picture_;
  std::atomic<int> stops_ = 0;
  std::atomic<bool> asked_ = true;
  std::string answers_;  // the page is asked once at a time here
  std::unique_ptr<Page> page_;
  std::unique_ptr<httplib::Client> client_;
};

TEST_F(LoopbackPage, ShowsStateAndStops) {
  const auto page = Get("/");
  ASSERT_TRUE(page);
  EXPECT_NE(page->body.find("/api/stop"), std::string::npos) << "has a stop button";
  const auto status = Get("/api/status");
  ASSERT_TRUE(status);
  EXPECT_EQ(nlohmann::json::parse(status->body)["state"], "capturing");
  const auto stop = client_->Post("/api/stop");
  ASSERT_TRUE(stop);
  EXPECT_EQ(stop->status, 200);
  EXPECT_EQ(stops_, 1);
  EXPECT_EQ(Get("/api/stop")->status, 404) << "a link cannot stop it, only a button";
  EXPECT_EQ(stops_, 1);
}

TEST_F(LoopbackPage, CarriesTheOperatorsAnswer) {
  EXPECT_EQ(client_->Post("/api/answer?confirmed=yes")->status, 200);
  EXPECT_EQ(client_->Post("/api/answer?confirmed=no")->status, 200);
  EXPECT_EQ(answers_, "yn");
  asked_ = false;
  EXPECT_EQ(client_->Post("/api/answer?confirmed=yes")->status, 409);
  EXPECT_EQ(Get("/api/answer?confirmed=yes")->status, 404) << "a link cannot answer";
}

TEST_F(LoopbackPage, ShowsTheLastPictureOnceThereIsOne) {
  EXPECT_EQ(Get("/api/picture")->status, 404);
  last_picture_ = folder_.path() / "v000.png";
  EXPECT_EQ(Get("/api/picture")->status, 404) << "named, not yet written";
  ASSERT_TRUE(WriteFileDurably(last_picture_, std::string_view("picture")));
  const auto picture = Get("/api/picture");
  EXPECT_EQ(picture->body, "picture");
  EXPECT_EQ(picture->get_header_value("Content-Type"), "image/png");
}

TEST_F(LoopbackPage, RefusesOtherHostsAndOrigins) {
  const std::string port = std::to_string(page_->port());
  EXPECT_EQ(Get("/api/status", {{"Host", "evil.example:" + port}})->status, 403);
  EXPECT_EQ(Get("/api/status", {{"Host", "127.0.0.1.evil.example"}})->status, 403);
  EXPECT_EQ(Get("/api/status", {{"Origin", "http://evil.example"}})->status, 403);
  EXPECT_EQ(client_->Post("/api/stop", {{"Origin", "null"}}, "", "text/plain")->status, 403);
  EXPECT_EQ(stops_, 0);
  EXPECT_EQ(Get("/api/status", {{"Host", "localhost:" + port}})->status, 200);
}

TEST_F(LoopbackPage, ATakenPortIsAnError) {
  const auto second = Page::Start(page_->port(), {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::bad_input);
}

TEST(Page, EndsAtOnce) {
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(Page::Start(0, {.status = [] { return nlohmann::json(); },
                                .stop = [] {},
                                .answer = {},
                                .last_picture = {}}));
  }
}

}  // namespace
}  // namespace scan

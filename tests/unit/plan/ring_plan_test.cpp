#include "acquisition/plan/ring_plan.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <limits>
#include <set>

namespace scan {
namespace {

std::vector<Ring> AnyRings() {
  const auto rings = *rc::gen::container<std::vector<Ring>>(rc::gen::build<Ring>(
      rc::gen::set(&Ring::aim_id, rc::gen::element<std::string>("a0", "a1", "high")),
      rc::gen::set(&Ring::lift_mm,
                   rc::gen::map(rc::gen::inRange(-100, 400), [](int v) { return 0.5 * v; })),
      rc::gen::set(&Ring::count, rc::gen::inRange(1, 40)),
      rc::gen::set(&Ring::start_deg,
                   rc::gen::map(rc::gen::inRange(-720, 720), [](int v) { return 0.25 * v; }))));
  RC_PRE(!rings.empty());
  return rings;
}

TEST(RingPlan, NamesViewsInOrderOfTheRings) {
  const auto views = PlanRings({{.aim_id = "a0", .lift_mm = 10, .count = 2, .start_deg = 5},
                                {.aim_id = "a1", .lift_mm = 40, .count = 1, .exposure_us = 800}});
  ASSERT_TRUE(views) << ToString(views.error());
  ASSERT_EQ(views->size(), 3u);
  EXPECT_EQ((*views)[0].id, "v000");
  EXPECT_EQ((*views)[1].id, "v001");
  EXPECT_DOUBLE_EQ((*views)[1].turntable_deg, 185);
  EXPECT_EQ((*views)[1].aim_id, "a0");
  EXPECT_EQ((*views)[2].id, "v002");
  EXPECT_EQ((*views)[2].aim_id, "a1");
  EXPECT_EQ((*views)[2].exposure_us, 800);
  EXPECT_EQ((*views)[0].exposure_us, 0);
}

TEST(RingPlan, EachRingTurnsOneWayInEqualStepsOverLessThanOneTurn) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<Ring> rings = AnyRings();
    const auto views = PlanRings(rings);
    RC_ASSERT(views.has_value());
    std::set<std::string> ids;
    std::size_t at = 0;
    for (const Ring& ring : rings) {
      const double step = 360.0 / ring.count;
      for (int i = 0; i < ring.count; ++i, ++at) {
        const PlannedView& view = views->at(at);
        ids.insert(view.id);
        RC_ASSERT(view.lift_mm == ring.lift_mm && view.aim_id == ring.aim_id);
        RC_ASSERT(view.turntable_deg >= ring.start_deg);
        RC_ASSERT(view.turntable_deg < ring.start_deg + 360);
        if (i > 0)
          RC_ASSERT(std::abs(view.turntable_deg - (*views)[at - 1].turntable_deg - step) < 1e-9);
      }
    }
    RC_ASSERT(at == views->size() && ids.size() == views->size());
  }));
}

TEST(RingPlan, RefusesWhatCannotBePlanned) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::vector<Ring>> bad = {{},
                                              {{.count = 0}},
                                              {{.count = -3}},
                                              {{.count = 3601}},
                                              {{.lift_mm = nan}},
                                              {{.start_deg = nan}},
                                              {{.exposure_us = -1.0}},
                                              {{.aim_id = "A 0"}},
                                              {{.cameras = {""}}},
                                              {{.cameras = {}}},
                                              std::vector<Ring>(30, Ring{.count = 3600})};
  for (const auto& rings : bad) {
    const auto views = PlanRings(rings);
    ASSERT_FALSE(views);
    EXPECT_EQ(views.error().kind, ErrorKind::bad_input);
    EXPECT_FALSE(views.error().mend.empty());
  }
}

TEST(RingPlan, RefusesTwoViewsOfOneId) {
  PlannedView view;
  view.id = "v000";
  const Status status = CheckViews({view, view});
  ASSERT_FALSE(status);
  EXPECT_NE(ToString(status.error()).find("v000"), std::string::npos);
}

}  // namespace
}  // namespace scan

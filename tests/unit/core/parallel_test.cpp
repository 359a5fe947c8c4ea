#include "core/parallel.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace skullstation {
namespace {

TEST(ParallelFor, EachIndexIsVisitedOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 7}) {
    std::vector<int> visits(1000, 0);
    parallel_for(1000, threads, [&](int i) { ++visits[i]; });
    EXPECT_EQ(visits, std::vector<int>(1000, 1));
  }
}

TEST(ParallelFor, NothingToDoIsNoWork) {
  parallel_for(0, 4, [](int) { FAIL(); });
}

TEST(ParallelFor, AnExceptionReachesTheCaller) {
  EXPECT_THROW(parallel_for(100, 3,
                            [](int i) {
                              if (i == 50) throw std::runtime_error("index 50");
                            }),
               std::runtime_error);
}

TEST(ThreadCount, ZeroMeansAllOfThem) {
  EXPECT_EQ(thread_count(3), 3);
  EXPECT_GE(thread_count(0), 1);
}

}  // namespace
}  // namespace skullstation

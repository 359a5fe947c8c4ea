#include "core/result.h"

#include <gtest/gtest.h>

namespace skullstation {
namespace {

Result<int> half(int n) {
  if (n % 2 != 0) return fail(ErrorKind::usage, "--n", "must be even", "try 2");
  return n / 2;
}

Result<std::string> half_as_text(int n) {
  const auto h = half(n);
  if (!h) return forward(h);
  return std::to_string(*h);
}

TEST(Result, AnErrorIsHandedOnWhole) {
  EXPECT_EQ(half_as_text(8), "4");
  ASSERT_FALSE(half_as_text(3));
  EXPECT_EQ(half_as_text(3).error().message(), "--n: must be even; try 2");
}

TEST(Result, AnErrorOfAFilesContentNamesTheFile) {
  EXPECT_EQ(forward("numbers.txt", half(3)).value().message(),
            "numbers.txt, --n: must be even; try 2");
}

TEST(Error, EmptyPartsLeaveNoPunctuation) {
  EXPECT_EQ((Error{ErrorKind::cancelled, "", "stopped", ""}.message()), "stopped");
}

TEST(ExitCode, IsAsDocumentedForEachKind) {
  EXPECT_EQ(exit_code(ErrorKind::usage), 2);
  EXPECT_EQ(exit_code(ErrorKind::bad_input), 3);
  EXPECT_EQ(exit_code(ErrorKind::hardware), 4);
  EXPECT_EQ(exit_code(ErrorKind::no_result), 5);
  EXPECT_EQ(exit_code(ErrorKind::cancelled), 130);
}

}  // namespace
}  // namespace skullstation

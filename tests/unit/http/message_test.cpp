#include "daemon/http/message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/http/server.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(HttpTarget, IsDecoded) {
  const auto target = parse_target("/cases/7?search=2026%2D0042+a&most=5&search=b%C3%A4");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->path, "/cases/7");
  EXPECT_EQ(target->query.at("search"), "bä");
  EXPECT_EQ(target->query.at("most"), "5");
  EXPECT_EQ(parse_target("/a%20b+c")->path, "/a b+c");
  EXPECT_EQ(parse_target("/?x")->query.at("x"), "");
}

TEST(HttpTarget, LeavesNoWayOut) {
  for (const char* target : {"",
                             "x",
                             "*",
                             "http://elsewhere/",
                             "/a//b",
                             "/../etc/passwd",
                             "/a/%2e%2e/b",
                             "/a/.",
                             "/%2E./x",
                             "/a%2f..%2fb",
                             "/%00",
                             "/a%0d%0aSet-Cookie:x",
                             "/%",
                             "/%1",
                             "/%zz",
                             "/%ff",
                             "/%c0%ae",
                             "/a?b=%00",
                             "/%ed%a0%80",
                             "/?%f5"}) {
    EXPECT_FALSE(parse_target(target)) << target;
  }
}

TEST(HttpCookie, IsFoundAmongOthers) {
  Request request;
  EXPECT_EQ(cookie_of(request, "a"), "");
  request.headers["cookie"] = "x=1; aa=2; a=3; b";
  EXPECT_EQ(cookie_of(request, "a"), "3");
  EXPECT_EQ(cookie_of(request, "b"), "");
  EXPECT_EQ(cookie_of(request, "x"), "1");
}

TEST(HttpRange, AsTheStandardHasIt) {
  using Part = std::pair<std::uint64_t, std::uint64_t>;
  EXPECT_EQ(parse_range("bytes=0-0", 10).begin_and_bytes, (Part{0, 1}));
  EXPECT_EQ(parse_range("bytes=2-", 10).begin_and_bytes, (Part{2, 8}));
  EXPECT_EQ(parse_range("bytes=2-99", 10).begin_and_bytes, (Part{2, 8}));
  EXPECT_EQ(parse_range("bytes=-3", 10).begin_and_bytes, (Part{7, 3}));
  EXPECT_EQ(parse_range("bytes=-30", 10).begin_and_bytes, (Part{0, 10}));
  EXPECT_FALSE(parse_range("bytes=10-", 10).satisfiable);
  EXPECT_FALSE(parse_range("bytes=-0", 10).satisfiable);
  EXPECT_FALSE(parse_range("bytes=0-", 0).satisfiable);
  for (const char* none : {"", "bytes", "bytes=", "bytes=a-b", "bytes=5-2", "bytes=0-1,3-4",
                           "lines=0-1", "bytes=99999999999999999999-", "bytes=--1", "bytes=0-1x"}) {
    EXPECT_TRUE(parse_range(none, 10).satisfiable) << none;
    EXPECT_FALSE(parse_range(none, 10).begin_and_bytes) << none;
  }
}

TEST(HttpHead, CarriesWhatEveryAnswerMust) {
  const std::string head = head_of(json_answer(200, "{}"), true);
  EXPECT_THAT(head, HasSubstr("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(head, HasSubstr("Content-Length: 2\r\n"));
  for (const char* header : {"X-Content-Type-Options: nosniff", "default-src 'none'", "no-store",
                             "Strict-Transport-Security", "Connection: keep-alive"}) {
    EXPECT_THAT(head, HasSubstr(header));
  }
  const std::string odd = head_of({200, {{"X-Preview", "a\r\nSet-Cookie: b"}}}, false);
  EXPECT_THAT(odd, Not(HasSubstr("\r\nSet-Cookie")));
  EXPECT_THAT(odd, HasSubstr("Connection: close"));
}

TEST(HttpHead, ErrorsHaveTheirStatus) {
  EXPECT_EQ(refusal(Error{ErrorKind::usage, "", "x", ""}).status, 409u);
  EXPECT_EQ(refusal(Error{ErrorKind::bad_input, "", "x", ""}).status, 422u);
  EXPECT_EQ(refusal(Error{ErrorKind::hardware, "", "x", ""}).status, 503u);
  EXPECT_EQ(refusal(Error{ErrorKind::no_result, "", "x", ""}).status, 500u);
  EXPECT_THAT(refusal(400, "x", "not \xff UTF-8").body, HasSubstr("not"));
}

TEST(HttpRequest, IsReadFromBytes) {
  const auto read = read_request(
      "POST /api/v1/session?a=b HTTP/1.1\r\nHost: s\r\nX-A: 1\r\nx-a: 2\r\nCookie: a=1\r\nCookie: "
      "b=2\r\n"
      "Content-Length: 2\r\n\r\n{}",
      {});
  ASSERT_EQ(read.status, 200u);
  EXPECT_EQ(read.request.method, "POST");
  EXPECT_EQ(read.request.path, "/api/v1/session");
  EXPECT_EQ(read.request.header("x-a"), "1, 2");
  EXPECT_EQ(read.request.header("cookie"), "a=1; b=2");
  EXPECT_EQ(read.request.body, "{}");
}

TEST(HttpRequest, IsRefused) {
  const ServerOptions options;
  EXPECT_EQ(read_request("", options).status, 400u);
  EXPECT_EQ(read_request("hello\r\n\r\n", options).status, 400u);
  EXPECT_EQ(read_request("GET / HTTP/1.1\r\n\r\n", options).status, 400u) << "no host";
  EXPECT_EQ(read_request("GET /%2e%2e HTTP/1.1\r\nHost: s\r\n\r\n", options).status, 400u);
  EXPECT_EQ(read_request("GET / HTTP/1.1\r\nHost: s\r\nX: " + std::string(20000, 'x') + "\r\n\r\n",
                         options)
                .status,
            431u);
  EXPECT_EQ(read_request("POST / HTTP/1.1\r\nHost: s\r\nContent-Length: 99999999\r\n\r\n", options)
                .status,
            413u);
  // Two lengths: what a proxy before us takes for the next request.
  EXPECT_EQ(read_request("POST / HTTP/1.1\r\nHost: s\r\nContent-Length: 1\r\nTransfer-Encoding: "
                         "chunked\r\n\r\n0\r\n\r\n",
                         options)
                .status,
            400u);
}

}  // namespace
}  // namespace skullstation

// S3 and what speaks like it: requests signed with SigV4 by libcurl, addresses with the bucket in
// the path. An object appears whole or not at all by itself.

#include <fmt/format.h>

#include "core/file.h"
#include "core/url_path.h"
#include "daemon/delivery/curl_session.h"
#include "daemon/delivery/target.h"

namespace skullstation {

namespace {

/// The most that a single PUT may carry.
constexpr std::uint64_t most_bytes = std::uint64_t{5} << 30;

class S3Target final : public Target {
 public:
  S3Target(std::string address, std::unique_ptr<CurlSession> session)
      : address_(std::move(address)), session_(std::move(session)) {}

  Result<void> put(const DeliveryObject& object, const Progress& progress) override {
    if (object.bytes > most_bytes) {
      return fail(ErrorKind::bad_input, object.name,
                  "is larger than 5 GiB, the most that S3 takes at once");
    }
    const auto answer =
        session_->send({.method = "PUT",
                        .url = url_of(object),
                        .headers = {"x-amz-content-sha256: " + object.sha256, "If-None-Match: *",
                                    "Content-Type: application/octet-stream"},
                        .file = object.file},
                       progress);
    if (!answer) return forward(answer);
    // 412: there is one already.
    if (answer->status != 200 && answer->status != 412)
      return status_error(url_of(object), *answer);
    return {};
  }

  Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                               const Progress& progress) override {
    const auto answer =
        session_->send({.url = url_of(object), .headers = nothing_sent()}, progress);
    if (!answer) return forward(answer);
    if (answer->status == 404 && answer->body.find("NoSuchBucket") == std::string::npos) {
      return std::optional<std::string>();
    }
    if (answer->status != 200) return status_error(url_of(object), *answer);
    return std::optional(answer->sha256);
  }

  Result<bool> remove(const DeliveryObject& object) override {
    const auto answer =
        session_->send({.method = "DELETE", .url = url_of(object), .headers = nothing_sent()});
    if (!answer) return forward(answer);
    if (answer->status != 204 && answer->status != 200)
      return status_error(url_of(object), *answer);
    return true;
  }

 private:
  static std::vector<std::string> nothing_sent() {
    return {"x-amz-content-sha256: " + sha256_hex("")};
  }
  std::string url_of(const DeliveryObject& object) const {
    return address_ + "/" + url_path(object.name);
  }

  std::string address_;
  std::unique_ptr<CurlSession> session_;
};

}  // namespace

Result<std::unique_ptr<Target>> open_s3_target(const TargetConfig& config) {
  auto session = CurlSession::open(config);
  if (!session) return forward(session);
  return std::make_unique<S3Target>(without_slash(config.address), *std::move(session));
}

}  // namespace skullstation

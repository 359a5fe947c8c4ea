#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "daemon/delivery/secret.h"
#include "daemon/delivery/target_config.h"

namespace skullstation {

/// One request. What is sent is `before`, the file, `after`, one after the other.
struct CurlRequest {
  std::string method = "GET";
  std::string url;
  std::vector<std::string> headers;  ///< "Name: value"
  std::string before;
  std::filesystem::path file;  ///< empty: none
  std::string after;
  /// How much of the answer is kept in memory; the rest is summed up and let go.
  std::size_t keep_bytes = 65536;
  std::vector<std::string> then;  ///< sftp: commands after the transfer
};

struct CurlAnswer {
  int status = 0;  ///< of HTTP
  std::string body;
  std::string content_type;
  std::uint64_t bytes = 0;  ///< of the whole body
  std::string sha256;       ///< of the whole body
};

/// A connection to a receiver that speaks HTTP or SFTP, by libcurl: kept open between requests. No
/// redirects, no proxies, TLS 1.2 at least, certificates and host keys always checked. Gives up
/// when nothing moves for a minute.
class CurlSession {
 public:
  /// How the secret is shown to the receiver: as the user's password (a token, without a user), or
  /// by signing (SigV4).
  static Result<std::unique_ptr<CurlSession>> open(const TargetConfig& config);
  ~CurlSession();
  CurlSession(const CurlSession&) = delete;
  CurlSession& operator=(const CurlSession&) = delete;

  /// Any HTTP status is an answer. Fails where there is none (Target says how errors are sorted).
  Result<CurlAnswer> send(const CurlRequest& request, const Progress& progress = {});
  /// sftp: is the file of the last request simply not there?
  bool file_was_missing() const { return file_was_missing_; }

 private:
  struct Parts;
  explicit CurlSession(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
  bool file_was_missing_ = false;
};

/// What an HTTP status that was not hoped for means for the delivery.
tl::unexpected<Error> status_error(const std::string& url, const CurlAnswer& answer);

/// The address without an ending '/'.
std::string without_slash(std::string address);

}  // namespace skullstation

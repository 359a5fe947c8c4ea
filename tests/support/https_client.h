#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

namespace skullstation::testing {

struct HttpsAnswer {
  int status = 0;                              ///< 0: the connection ended without an answer
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
};

/// A TLS connection to a server on this machine, which it does not check. Each wait ends when
/// patience does.
class HttpsClient {
 public:
  explicit HttpsClient(std::uint16_t port, std::chrono::seconds patience = std::chrono::seconds(5));
  ~HttpsClient();
  HttpsClient(const HttpsClient&) = delete;
  HttpsClient& operator=(const HttpsClient&) = delete;

  bool connected() const;
  /// False if the other side no longer takes it.
  bool send(const std::string& bytes);
  /// What comes next, at most so much; empty at the end or when nothing comes.
  std::string receive(std::size_t most = 65536);
  HttpsAnswer answer();
  /// Sends it whole; Host and Content-Length are added.
  HttpsAnswer ask(const std::string& method, const std::string& target,
                  const std::string& headers = "", const std::string& body = "");

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  std::uint16_t port_;
  std::string read_;
};

}  // namespace skullstation::testing

// SFTP by libcurl (libssh2). The host key is pinned by its fingerprint in the configuration: the
// session ends before anything is said to a host that shows another one. A file appears whole or
// not at all: another name, then a rename, which SFTP refuses where there is a file already.

#include <fmt/format.h>

#include "core/url_path.h"
#include "daemon/delivery/curl_session.h"
#include "daemon/delivery/target.h"

namespace skullstation {

namespace {

class SftpTarget final : public Target {
 public:
  SftpTarget(std::string address, std::unique_ptr<CurlSession> session)
      : address_(std::move(address)), session_(std::move(session)) {
    const auto slash = address_.find('/', std::string("sftp://").size());
    folder_ = slash == std::string::npos ? "" : address_.substr(slash);
  }

  Result<void> put(const DeliveryObject& object, const Progress& progress) override {
    const auto sent = session_->send(
        {.method = "PUT",
         .url = url_of(object.name + ".part"),
         .file = object.file,
         .then = {fmt::format("rename {} {}", quoted(object.name + ".part"), quoted(object.name))}},
        progress);
    if (!sent) return forward(sent);
    return {};
  }

  Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                               const Progress& progress) override {
    const auto answer = session_->send({.url = url_of(object.name)}, progress);
    if (answer) return std::optional(answer->sha256);
    if (session_->file_was_missing()) return std::optional<std::string>();
    return forward(answer);
  }

  Result<bool> remove(const DeliveryObject& object) override {
    const auto answer = session_->send(
        {.method = "NONE", .url = url_of(""), .then = {"rm " + quoted(object.name)}});
    if (!answer) return forward(answer);
    return true;
  }

 private:
  std::string url_of(const std::string& name) const { return address_ + "/" + url_path(name); }
  /// As libcurl's SFTP commands want paths.
  std::string quoted(const std::string& name) const {
    std::string path = "\"";
    for (const char c : folder_ + "/" + name) {
      if (c == '"' || c == '\\') path += '\\';
      path += c;
    }
    return path + "\"";
  }

  std::string address_;
  std::string folder_;
  std::unique_ptr<CurlSession> session_;
};

}  // namespace

Result<std::unique_ptr<Target>> open_sftp_target(const TargetConfig& config) {
  auto session = CurlSession::open(config);
  if (!session) return forward(session);
  return std::make_unique<SftpTarget>(without_slash(config.address), *std::move(session));
}

}  // namespace skullstation

// WebDAV (RFC 4918) over HTTPS. A file appears whole or not at all: PUT under another name, then
// MOVE without the right to overwrite.

#include <fmt/format.h>

#include <set>

#include "core/url_path.h"
#include "daemon/delivery/curl_session.h"
#include "daemon/delivery/target.h"

namespace skullstation {

namespace {

class WebdavTarget final : public Target {
 public:
  WebdavTarget(std::string address, std::unique_ptr<CurlSession> session)
      : address_(std::move(address)), session_(std::move(session)) {}

  Result<void> put(const DeliveryObject& object, const Progress& progress) override {
    if (auto made = make_folders(object.name); !made) return made;
    const std::string place = url_of(object.name);
    const std::string temporary = place + ".part";
    const auto sent =
        session_->send({.method = "PUT", .url = temporary, .file = object.file}, progress);
    if (!sent) return forward(sent);
    if (!good(sent->status)) return status_error(temporary, *sent);
    const auto moved = session_->send(
        {.method = "MOVE", .url = temporary, .headers = {"Destination: " + place, "Overwrite: F"}});
    if (!moved) return forward(moved);
    if (good(moved->status)) return {};
    const auto removed = session_->send({.method = "DELETE", .url = temporary});
    if (moved->status != 412) return status_error(place, *moved);
    if (!removed) return forward(removed);
    return {};
  }

  Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                               const Progress& progress) override {
    const auto answer = session_->send({.url = url_of(object.name)}, progress);
    if (!answer) return forward(answer);
    if (answer->status == 404) return std::optional<std::string>();
    if (answer->status != 200) return status_error(url_of(object.name), *answer);
    return std::optional(answer->sha256);
  }

  Result<bool> remove(const DeliveryObject& object) override {
    const auto answer = session_->send({.method = "DELETE", .url = url_of(object.name)});
    if (!answer) return forward(answer);
    if (!good(answer->status)) return status_error(url_of(object.name), *answer);
    return true;
  }

 private:
  static bool good(int status) { return status >= 200 && status < 300; }
  std::string url_of(const std::string& name) const { return address_ + "/" + url_path(name); }

  Result<void> make_folders(const std::string& name) {
    for (std::size_t slash = name.find('/'); slash != std::string::npos;
         slash = name.find('/', slash + 1)) {
      const std::string folder = url_of(name.substr(0, slash)) + "/";
      if (made_.contains(folder)) continue;
      const auto answer = session_->send({.method = "MKCOL", .url = folder});
      if (!answer) return forward(answer);
      // 405: it is there already.
      if (!good(answer->status) && answer->status != 405) return status_error(folder, *answer);
      made_.insert(folder);
    }
    return {};
  }

  std::string address_;
  std::unique_ptr<CurlSession> session_;
  std::set<std::string> made_;
};

}  // namespace

Result<std::unique_ptr<Target>> open_webdav_target(const TargetConfig& config) {
  auto session = CurlSession::open(config);
  if (!session) return forward(session);
  return std::make_unique<WebdavTarget>(without_slash(config.address), *std::move(session));
}

}  // namespace skullstation

#include "tests/support/console_user.h"

#include <fmt/format.h>

namespace skullstation::testing {

using nlohmann::json;

bool ConsoleUser::connect(std::uint16_t port) {
  // A password is checked for a while on a busy machine.
  client_ = std::make_unique<HttpsClient>(port, std::chrono::seconds(60));
  origin_ = fmt::format("Origin: https://localhost:{}\r\n", port);
  return client_->connected();
}

HttpsAnswer ConsoleUser::ask(const std::string& method, const std::string& path, const json& body) {
  const std::string type = body.is_null() ? "" : "Content-Type: application/json\r\n";
  return client_->ask(method, "/api/v1" + path, origin_ + signed_in_ + type,
                      body.is_null() ? "" : body.dump());
}

bool ConsoleUser::sign_in(const std::string& path, const json& body) {
  signed_in_.clear();
  const HttpsAnswer answer = ask("POST", path, body);
  if (answer.status != 201) return false;
  const std::string cookie = answer.headers.at("set-cookie");
  signed_in_ = fmt::format("Cookie: {}\r\nX-CSRF-Token: {}\r\n", cookie.substr(0, cookie.find(';')),
                           json::parse(answer.body)["csrf"].get<std::string>());
  return true;
}

}  // namespace skullstation::testing

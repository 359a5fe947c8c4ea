#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/https_client.h"

namespace skullstation::testing {

/// Somebody at a running console, over HTTPS, who sends what its pages would send.
class ConsoleUser {
 public:
  /// Anew after each start of the station; who is signed in stays so.
  bool connect(std::uint16_t port);

  /// `path` is below /api/v1. Status 0: the connection ended without an answer.
  HttpsAnswer ask(const std::string& method, const std::string& path,
                  const nlohmann::json& body = nullptr);

  /// POST to /setup or /session; from then on the account made or named there asks.
  bool sign_in(const std::string& path, const nlohmann::json& body);

 private:
  std::unique_ptr<HttpsClient> client_;
  std::string origin_;
  std::string signed_in_;  ///< headers
};

}  // namespace skullstation::testing

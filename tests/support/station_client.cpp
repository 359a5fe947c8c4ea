#include "tests/support/station_client.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <thread>

namespace skullstation::testing {

using namespace std::chrono_literals;

nlohmann::json ask_station(const std::filesystem::path& socket, const std::string& line) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
  const int client = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string text;
  if (::connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    const std::string sent = line + "\n";
    static_cast<void>(!::send(client, sent.data(), sent.size(), MSG_NOSIGNAL));
    char c = 0;
    while (::read(client, &c, 1) == 1) text += c;
  }
  ::close(client);
  return nlohmann::json::parse(text, nullptr, false);
}

bool comes_true(const std::function<bool()>& condition, std::chrono::seconds time) {
  const auto deadline = std::chrono::steady_clock::now() + time;
  while (std::chrono::steady_clock::now() < deadline) {
    if (condition()) return true;
    std::this_thread::sleep_for(5ms);
  }
  return condition();
}

}  // namespace skullstation::testing

#include "daemon/service/control_socket.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace skullstation {

namespace {

constexpr std::size_t longest_line = 4096;

/// One line, within two seconds; empty if there is none.
std::string read_line(int client) {
  std::string line;
  pollfd waiting{client, POLLIN, 0};
  while (line.size() < longest_line && ::poll(&waiting, 1, 2000) > 0) {
    char c = 0;
    if (::read(client, &c, 1) != 1) break;
    if (c == '\n') return line;
    line += c;
  }
  return {};
}

void write_line(int client, const std::string& line) {
  const std::string text = line + "\n";
  std::size_t sent = 0;
  while (sent < text.size()) {
    const ssize_t count = ::send(client, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return;
    sent += static_cast<std::size_t>(count);
  }
}

}  // namespace

Result<std::unique_ptr<ControlSocket>> ControlSocket::open(const std::filesystem::path& path,
                                                           Handler handler) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = path.string();
  if (name.size() >= sizeof address.sun_path) {
    return fail(ErrorKind::bad_input, name,
                fmt::format("is too long for a socket: {} characters, {} are allowed", name.size(),
                            sizeof address.sun_path - 1),
                "choose a shorter storage.folder");
  }
  std::memcpy(address.sun_path, name.data(), name.size());
  ::unlink(name.c_str());
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const mode_t before = ::umask(0177);
  const bool ready =
      listener >= 0 &&
      ::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      ::listen(listener, 8) == 0;
  const int failure = errno;
  ::umask(before);
  if (!ready) {
    if (listener >= 0) ::close(listener);
    return fail(ErrorKind::bad_input, name,
                fmt::format("can't be opened ({})", std::system_category().message(failure)));
  }
  return std::unique_ptr<ControlSocket>(new ControlSocket(path, listener, std::move(handler)));
}

ControlSocket::ControlSocket(std::filesystem::path path, int listener, Handler handler)
    : path_(std::move(path)),
      listener_(listener),
      handler_(std::move(handler)),
      server_([this](const std::stop_token& stop) { serve(stop); }) {}

ControlSocket::~ControlSocket() {
  server_.request_stop();
  server_.join();
  ::close(listener_);
  ::unlink(path_.c_str());
}

void ControlSocket::serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    pollfd waiting{listener_, POLLIN, 0};
    if (::poll(&waiting, 1, 100) <= 0) continue;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    if (const std::string line = read_line(client); !line.empty())
      write_line(client, handler_(line));
    ::close(client);
  }
}

}  // namespace skullstation

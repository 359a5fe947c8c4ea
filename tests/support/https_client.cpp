#include "tests/support/https_client.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <csignal>

namespace skullstation::testing {

struct HttpsClient::Parts {
  SSL_CTX* context = SSL_CTX_new(TLS_client_method());
  SSL* tls = SSL_new(context);
  int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  bool connected = false;

  ~Parts() {
    SSL_free(tls);
    SSL_CTX_free(context);
    ::close(socket);
  }
};

HttpsClient::HttpsClient(std::uint16_t port, std::chrono::seconds patience)
    : parts_(std::make_unique<Parts>()), port_(port) {
  std::signal(SIGPIPE, SIG_IGN);  // a server that hangs up is what some tests are about
  const timeval wait{patience.count(), 0};
  ::setsockopt(parts_->socket, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
  ::setsockopt(parts_->socket, SOL_SOCKET, SO_SNDTIMEO, &wait, sizeof wait);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  SSL_set_fd(parts_->tls, parts_->socket);
  parts_->connected =
      ::connect(parts_->socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
      SSL_connect(parts_->tls) == 1;
}

HttpsClient::~HttpsClient() = default;

bool HttpsClient::connected() const { return parts_->connected; }

bool HttpsClient::send(const std::string& bytes) {
  return bytes.empty() || SSL_write(parts_->tls, bytes.data(), static_cast<int>(bytes.size())) ==
                              static_cast<int>(bytes.size());
}

std::string HttpsClient::receive(std::size_t most) {
  std::string bytes(most, '\0');
  const int got = SSL_read(parts_->tls, bytes.data(), static_cast<int>(most));
  bytes.resize(static_cast<std::size_t>(std::max(0, got)));
  return bytes;
}

HttpsAnswer HttpsClient::answer() {
  while (read_.find("\r\n\r\n") == std::string::npos) {
    const std::string more = receive();
    if (more.empty()) return {};
    read_ += more;
  }
  HttpsAnswer answer;
  const std::size_t end = read_.find("\r\n\r\n");
  std::string head = read_.substr(0, end + 2);
  read_.erase(0, end + 4);
  answer.status = std::stoi(head.substr(head.find(' ') + 1));
  head.erase(0, head.find("\r\n") + 2);
  while (!head.empty()) {
    const std::string line = head.substr(0, head.find("\r\n"));
    head.erase(0, line.size() + 2);
    std::string name = line.substr(0, line.find(':'));
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    answer.headers[name] = line.substr(line.find(':') + 2);
  }
  const auto length = answer.headers.find("content-length");
  const std::size_t bytes = length == answer.headers.end() ? 0 : std::stoul(length->second);
  while (read_.size() < bytes) {
    const std::string more = receive();
    if (more.empty()) break;
    read_ += more;
  }
  answer.body = read_.substr(0, bytes);
  read_.erase(0, bytes);
  return answer;
}

HttpsAnswer HttpsClient::ask(const std::string& method, const std::string& target,
                             const std::string& headers, const std::string& body) {
  const std::string length = body.empty() ? "" : fmt::format("Content-Length: {}\r\n", body.size());
  send(fmt::format("{} {} HTTP/1.1\r\nHost: localhost:{}\r\n{}{}\r\n{}", method, target, port_,
                   length, headers, body));
  return answer();
}

}  // namespace skullstation::testing

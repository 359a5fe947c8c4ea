#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "core/result.h"
#include "daemon/http/message.h"
#include "daemon/http/tls_certificate.h"

namespace skullstation {

/// What a client may take up. Who wants more is refused or cut off.
struct ServerOptions {
  std::size_t most_header_bytes = std::size_t{16} << 10;
  std::size_t most_body_bytes = std::size_t{64} << 10;
  std::chrono::milliseconds handshake_time{10000};
  std::chrono::milliseconds header_time{15000};  ///< idle time before a request included
  std::chrono::milliseconds body_time{10000};
  std::chrono::milliseconds write_time{30000};  ///< of each piece of an answer
  std::size_t most_connections = 512;
  std::size_t most_from_one_address = 256;
  double requests_per_second = 200.0;  ///< of one address
  double burst = 400.0;
  int workers = 4;  ///< threads that answer
};

/// An HTTPS server (HTTP/1.1, TLS 1.2 and 1.3). One thread moves bytes, a few answer.
class HttpServer {
 public:
  /// Called from several threads at once.
  using Handler = std::function<Response(const Request&)>;

  /// Error (bad_input): the certificate is not accepted.
  static Result<std::unique_ptr<HttpServer>> start(const TlsCertificate& certificate,
                                                   const ServerOptions& options, Handler handler);
  ~HttpServer();  ///< ends every connection
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Listens here instead of where it listened so far; who is connected stays. Port 0 takes a free
  /// one. Returns the port. Errors (bad_input): no address of this machine, or the port is taken.
  Result<std::uint16_t> listen(const std::string& address, std::uint16_t port);

 private:
  struct Parts;
  explicit HttpServer(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
};

/// What a connection makes of the bytes of one request: the request or, with another status than
/// 200, why it was refused.
struct ReadRequest {
  unsigned status = 200;
  Request request;
};
ReadRequest read_request(std::string_view bytes, const ServerOptions& options);

}  // namespace skullstation

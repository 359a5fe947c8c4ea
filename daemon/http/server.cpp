#include "daemon/http/server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <future>
#include <map>
#include <optional>
#include <thread>

#include "core/file_descriptor.h"
#include "daemon/http/event_queue.h"
#include "daemon/http/limits.h"

// The only source that knows Boost.

namespace skullstation {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
using boost::system::error_code;
using net::ip::tcp;

namespace {

using Parser = http::request_parser<http::string_body>;

void limit(Parser& parser, const ServerOptions& options) {
  parser.header_limit(static_cast<std::uint32_t>(options.most_header_bytes));
  parser.body_limit(options.most_body_bytes);
}

unsigned status_of(error_code error) {
  if (error == http::error::header_limit) return 431;
  if (error == http::error::body_limit) return 413;
  return 400;
}

std::string text_of(beast::string_view text) { return {text.data(), text.size()}; }

/// Our words for what the library read; status 400 where it makes no sense.
ReadRequest plain_request(const http::request<http::string_body>& read) {
  ReadRequest plain;
  Request& request = plain.request;
  request.method = text_of(read.method_string());
  auto target = parse_target(text_of(read.target()));
  if (!target) return {400, {}};
  request.path = std::move(target->path);
  request.query = std::move(target->query);
  for (const auto& field : read) {
    std::string name = text_of(field.name_string());
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    auto [entry, added] = request.headers.try_emplace(name, text_of(field.value()));
    if (!added) entry->second += (name == "cookie" ? "; " : ", ") + text_of(field.value());
  }
  if (!request.headers.contains("host")) return {400, {}};
  request.body = read.body();
  return plain;
}

/// Who is connected, for the limits. Used by the thread that moves bytes alone.
struct Guests {
  std::size_t all = 0;
  std::map<std::string, std::size_t> from;

  bool let_in(const std::string& address, const ServerOptions& options) {
    if (all >= options.most_connections || from[address] >= options.most_from_one_address) {
      return false;
    }
    ++all;
    ++from[address];
    return true;
  }
  void gone(const std::string& address) {
    --all;
    if (--from[address] == 0) from.erase(address);
  }
};

}  // namespace

struct HttpServer::Parts {
  Parts(const ServerOptions& wanted, Handler answering)
      : options(wanted),
        handler(std::move(answering)),
        workers(static_cast<std::size_t>(wanted.workers)),
        requests(wanted.requests_per_second, wanted.burst) {}

  const ServerOptions options;
  const Handler handler;
  net::ssl::context tls{net::ssl::context::tls_server};
  net::thread_pool workers;
  RequestLimit requests;
  Guests guests;
  net::io_context context{1};
  std::shared_ptr<tcp::acceptor> acceptor;  // of the thread below, like the guests
  net::executor_work_guard<net::io_context::executor_type> work = net::make_work_guard(context);
  std::thread mover;
};

namespace {

/// What a connection needs of its server.
struct Host {
  const ServerOptions& options;
  const HttpServer::Handler& handler;
  net::thread_pool& workers;
  RequestLimit& requests;
  Guests& guests;
};

/// One client: handshake, then request after request. Everything runs on the server's one thread
/// but the handler, which a worker calls.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, net::ssl::context& tls, Host host, std::string peer)
      : stream_(beast::tcp_stream(std::move(socket)), tls), host_(host), peer_(std::move(peer)) {}

  ~Connection() {
    if (events_) events_->on_news({});
    if (events_) events_->close();
    host_.guests.gone(peer_);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void run() {
    transport().expires_after(host_.options.handshake_time);
    stream_.async_handshake(net::ssl::stream_base::server,
                            [self = shared_from_this()](error_code error) {
                              if (!error) self->read_head();
                            });
  }

 private:
  beast::tcp_stream& transport() { return beast::get_lowest_layer(stream_); }

  void read_head() {
    parser_.emplace();
    limit(*parser_, host_.options);
    transport().expires_after(host_.options.header_time);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](error_code error, std::size_t) {
                              if (error) return self->give_up(error);
                              self->read_body();
                            });
  }

  void read_body() {
    transport().expires_after(host_.options.body_time);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t) {
                       if (error) return self->give_up(error);
                       self->answer();
                     });
  }

  /// Says why, where somebody who speaks HTTP is still listening.
  void give_up(error_code error) {
    const bool gone = error == http::error::end_of_stream ||
                      error == http::error::partial_message || error == beast::error::timeout ||
                      error.category() != make_error_code(http::error::bad_target).category();
    if (gone) return close();
    keep_alive_ = false;
    send(refusal(status_of(error), "bad_request", "the request can't be read"));
  }

  void answer() {
    const auto& read = parser_->get();
    keep_alive_ = read.keep_alive();
    ReadRequest plain = plain_request(read);
    if (plain.status != 200) {
      keep_alive_ = false;
      return send(refusal(plain.status, "bad_request", "the request makes no sense"));
    }
    if (!host_.requests.take(peer_, std::chrono::steady_clock::now())) {
      Response slow_down = refusal(429, "too_many", "too many requests; wait a little");
      slow_down.headers.emplace_back("Retry-After", "1");
      return send(std::move(slow_down));
    }
    plain.request.peer = peer_;
    head_only_ = plain.request.method == "HEAD";
    if (head_only_) plain.request.method = "GET";
    net::post(
        host_.workers, [self = shared_from_this(), request = std::move(plain.request)]() mutable {
          auto response = self->answer_of(request);
          // The connection must end on its own thread, so no worker keeps it.
          const auto thread = self->stream_.get_executor();
          net::post(thread, [self = std::move(self), response = std::move(response)]() mutable {
            self->send(std::move(response));
          });
        });
  }

  Response answer_of(const Request& request) const {
    try {
      return host_.handler(request);
    } catch (const std::exception& unexpected) {
      return refusal(500, "failed", unexpected.what());
    }
  }

  void send(Response response) {
    head_ = head_of(response, keep_alive_ && response.events == nullptr);
    if (!head_only_ && !response.file) head_ += response.body;
    file_ = head_only_ ? std::nullopt : std::move(response.file);
    events_ = head_only_ ? nullptr : std::move(response.events);
    write(head_, [this] {
      if (events_) return begin_events();
      if (file_) return begin_file();
      next_request();
    });
  }

  /// Writes the bytes, which must stay where they are, then goes on.
  template <class Then>
  void write(const std::string& bytes, Then then) {
    transport().expires_after(host_.options.write_time);
    net::async_write(stream_, net::buffer(bytes),
                     [self = shared_from_this(), then](error_code error, std::size_t) {
                       if (error) return self->close_now();
                       then();
                     });
  }

  void begin_file() {
    file_descriptor_.emplace(::open(file_->file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    // The head has gone: all that is left is to end before the promised bytes.
    if (file_descriptor_->get() < 0) return close_now();
    next_part();
  }

  void next_part() {
    constexpr std::uint64_t part_bytes = std::uint64_t{256} << 10;
    if (file_->bytes == 0) {
      file_descriptor_.reset();
      return next_request();
    }
    head_.resize(std::min(part_bytes, file_->bytes));
    const ssize_t got = ::pread(file_descriptor_->get(), head_.data(), head_.size(),
                                static_cast<off_t>(file_->begin));
    if (got <= 0) return close_now();
    head_.resize(static_cast<std::size_t>(got));
    file_->begin += head_.size();
    file_->bytes -= head_.size();
    write(head_, [this] { next_part(); });
  }

  void begin_events() {
    // Nothing is expected from the client any more; what comes, an end included, ends the stream.
    transport().expires_never();
    stream_.async_read_some(net::buffer(unwanted_),
                            [self = shared_from_this()](error_code, std::size_t) {
                              self->events_->close();
                              self->close_now();
                            });
    events_->on_news([weak = weak_from_this()] {
      if (auto self = weak.lock()) {
        const auto thread = self->stream_.get_executor();
        net::post(thread, [self = std::move(self)] { self->pump(); });
      }
    });
    pump();
  }

  void pump() {
    if (writing_) return;
    head_ = events_->take();
    if (head_.empty()) {
      if (events_->closed()) close();
      return;
    }
    writing_ = true;
    write(head_, [this] {
      writing_ = false;
      pump();
    });
  }

  void next_request() {
    if (!keep_alive_) return close();
    read_head();
  }

  /// Tells the client that this is the end, so that it can tell it from a broken line.
  void close() {
    transport().expires_after(std::chrono::seconds(2));
    stream_.async_shutdown([self = shared_from_this()](error_code) {});
  }

  void close_now() {
    error_code ignored;
    transport().socket().close(ignored);
  }

  beast::ssl_stream<beast::tcp_stream> stream_;
  Host host_;
  const std::string peer_;
  beast::flat_buffer buffer_{std::size_t{128} << 10};
  std::optional<Parser> parser_;
  bool keep_alive_ = true;
  bool head_only_ = false;
  std::string head_;  // what is being written
  std::optional<FilePart> file_;
  std::optional<FileDescriptor> file_descriptor_;
  std::shared_ptr<EventQueue> events_;
  bool writing_ = false;
  std::array<char, 64> unwanted_{};
};

/// Lets one guest after the other in.
void accept_from(const std::shared_ptr<tcp::acceptor>& acceptor, net::ssl::context& tls,
                 const Host& host) {
  acceptor->async_accept([acceptor, &tls, host](error_code error, tcp::socket socket) {
    if (error == net::error::operation_aborted) return;
    if (!error) {
      error_code gone;
      const auto remote = socket.remote_endpoint(gone);
      const std::string peer = gone ? "" : remote.address().to_string();
      if (!gone && host.guests.let_in(peer, host.options)) {
        socket.set_option(tcp::no_delay(true), gone);
        std::make_shared<Connection>(std::move(socket), tls, host, peer)->run();
      }
    } else {
      // No descriptors are left: whoever goes makes room.
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    accept_from(acceptor, tls, host);
  });
}

}  // namespace

HttpServer::HttpServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {
  parts_->mover = std::thread([parts = parts_.get()] { parts->context.run(); });
}

HttpServer::~HttpServer() {
  parts_->context.stop();
  parts_->mover.join();
  parts_->workers.join();
}

Result<std::unique_ptr<HttpServer>> HttpServer::start(const TlsCertificate& certificate,
                                                      const ServerOptions& options,
                                                      Handler handler) {
  auto parts = std::make_unique<Parts>(options, std::move(handler));
  error_code error;
  parts->tls.set_options(net::ssl::context::default_workarounds | net::ssl::context::no_tlsv1 |
                             net::ssl::context::no_tlsv1_1 | net::ssl::context::no_sslv2 |
                             net::ssl::context::no_sslv3,
                         error);
  SSL_CTX_set_min_proto_version(parts->tls.native_handle(), TLS1_2_VERSION);
  SSL_CTX_set_options(parts->tls.native_handle(), SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_mode(parts->tls.native_handle(), SSL_MODE_RELEASE_BUFFERS);  // memory of idle guests
  if (!error) parts->tls.use_certificate_chain(net::buffer(certificate.chain_pem), error);
  if (!error) {
    parts->tls.use_private_key(net::buffer(certificate.key_pem), net::ssl::context::pem, error);
  }
  if (error) {
    return fail(ErrorKind::bad_input, "http.certificate",
                fmt::format("is not accepted ({})", error.message()));
  }
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(parts)));
}

Result<std::uint16_t> HttpServer::listen(const std::string& address, std::uint16_t port) {
  const std::string place = fmt::format("{}:{}", address, port);
  error_code error;
  const auto parsed = net::ip::make_address(address, error);
  if (error) {
    return fail(ErrorKind::bad_input, "http.address",
                fmt::format("\"{}\" is no IP address", address),
                "give 127.0.0.1, 0.0.0.0 or an address of this machine");
  }
  // A port can't be had for all addresses while it is in use for one.
  std::promise<void> closed;
  net::post(parts_->context, [&closed, parts = parts_.get()] {
    error_code ignored;
    if (parts->acceptor) parts->acceptor->close(ignored);
    parts->acceptor.reset();
    closed.set_value();
  });
  closed.get_future().wait();
  const tcp::endpoint endpoint(parsed, port);
  auto acceptor = std::make_shared<tcp::acceptor>(parts_->context);
  acceptor->open(endpoint.protocol(), error);
  if (!error) acceptor->set_option(net::socket_base::reuse_address(true), error);
  if (!error) acceptor->bind(endpoint, error);
  if (!error) acceptor->listen(net::socket_base::max_listen_connections, error);
  if (error) {
    return fail(ErrorKind::bad_input, place,
                fmt::format("the console can't be reached there ({})", error.message()),
                "choose another http.port or http.address in station.toml");
  }
  const std::uint16_t taken = acceptor->local_endpoint().port();
  net::post(parts_->context, [parts = parts_.get(), acceptor] {
    parts->acceptor = acceptor;
    accept_from(acceptor, parts->tls,
                {parts->options, parts->handler, parts->workers, parts->requests, parts->guests});
  });
  return taken;
}

ReadRequest read_request(std::string_view bytes, const ServerOptions& options) {
  Parser parser;
  limit(parser, options);
  parser.eager(true);
  error_code error;
  while (!parser.is_done() && !bytes.empty()) {
    const std::size_t taken = parser.put(net::buffer(bytes.data(), bytes.size()), error);
    if (error) return {status_of(error), {}};
    bytes.remove_prefix(taken);
    if (taken == 0) break;
  }
  if (!parser.is_done()) return {400, {}};
  return plain_request(parser.get());
}

}  // namespace skullstation

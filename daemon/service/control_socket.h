#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "core/result.h"

namespace skullstation {

/// A local socket that only this user may open. A client sends one line and is answered with one
/// line; what they mean is the handler's.
class ControlSocket {
 public:
  using Handler = std::function<std::string(const std::string& line)>;

  /// Takes the place of what an earlier process left there. Error (bad_input): the path is too long
  /// for a socket, or its folder can't be written to.
  static Result<std::unique_ptr<ControlSocket>> open(const std::filesystem::path& path,
                                                     Handler handler);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

 private:
  ControlSocket(std::filesystem::path path, int listener, Handler handler);
  void serve(const std::stop_token& stop);

  const std::filesystem::path path_;
  const int listener_;
  const Handler handler_;
  std::jthread server_;  // last: it uses everything above
};

}  // namespace skullstation

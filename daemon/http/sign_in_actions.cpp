#include <fmt/format.h>

#include "daemon/http/actions.h"

namespace skullstation::actions {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const SignIn& who) {
  return {{"account", who.account}, {"role", to_string(who.role)}, {"csrf", who.csrf}};
}

/// Empty again: a browser forgets the cookie.
std::string cookie_with(const std::string& token) {
  return fmt::format("{}={}; Path=/; Secure; HttpOnly; SameSite=Strict{}", session_cookie, token,
                     token.empty() ? "; Max-Age=0" : "");
}

Response signed_in_as(Console& console, const std::string& account, unsigned status) {
  const auto made = console.accounts.sign_in(account);
  if (!made) return refusal(made.error());
  Response response = json_answer(status, json_of(made->sign_in).dump());
  response.headers.emplace_back("Set-Cookie", cookie_with(made->token));
  return response;
}

/// How long this account must wait before its next guess, as an answer.
std::optional<Response> must_wait(Console& console, const std::string& account,
                                  const std::string& address) {
  const auto wait = console.guesses.begin(account, address);
  if (wait.count() == 0) return std::nullopt;
  Response response =
      refusal(429, "wait", fmt::format("too many wrong tries; wait {} s", wait.count()));
  response.headers.emplace_back("Retry-After", std::to_string(wait.count()));
  return response;
}

}  // namespace

Response setup_state(Console& console, Call&) {
  const auto none = console.accounts.none();
  if (!none) return refusal(none.error());
  return json_answer(
      200, Json{{"needed", *none}, {"station", console.service.config().station_id}}.dump());
}

Response set_up(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const std::string code = body.text("code");
  const std::string name = body.text("name");
  const std::string password = body.text("password");
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  call.details["account"] = name;
  const auto none = console.accounts.none();
  if (!none) return refusal(none.error());
  if (!*none) return refusal(409, "set_up", "this station is set up already");
  if (auto wait = must_wait(console, "", call.request.peer)) return *wait;
  if (code != console.setup_code) {
    return refusal(403, "setup_code", "that is not the code that the station printed at its start");
  }
  console.guesses.right("", call.request.peer);
  if (auto added = console.accounts.add(name, Role::administrator, password); !added) {
    return refusal(added.error());
  }
  call.who.account = name;
  console.on_set_up();
  return signed_in_as(console, name, 201);
}

Response sign_in(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const std::string name = body.text("name");
  const std::string password = body.text("password");
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  // A name that was typed into the wrong field may be a password: only real ones are written down.
  if (auto wait = must_wait(console, name, call.request.peer)) return *wait;
  const auto account = console.accounts.check(name, password);
  if (!account) return refusal(account.error());
  if (!*account) return refusal(401, "wrong_password", "name or password is wrong");
  console.guesses.right(name, call.request.peer);
  call.who.account = name;
  return signed_in_as(console, name, 201);
}

Response who_am_i(Console&, Call& call) { return json_answer(200, json_of(call.who).dump()); }

Response sign_out(Console& console, Call& call) {
  if (auto ended = console.accounts.sign_out(call.token); !ended) return refusal(ended.error());
  return {204, {{"Set-Cookie", cookie_with("")}}};
}

Response change_password(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const std::string old_password = body.text("old");
  const std::string new_password = body.text("new");
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  if (auto wait = must_wait(console, call.who.account, call.request.peer)) return *wait;
  const auto account = console.accounts.check(call.who.account, old_password);
  if (!account) return refusal(account.error());
  if (!*account) return refusal(403, "wrong_password", "the old password is wrong");
  console.guesses.right(call.who.account, call.request.peer);
  if (auto set = console.accounts.set_password(call.who.account, new_password); !set) {
    return refusal(set.error());
  }
  return signed_in_as(console, call.who.account, 200);
}

}  // namespace skullstation::actions

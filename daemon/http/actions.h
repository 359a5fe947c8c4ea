#pragma once

#include "daemon/http/console.h"

namespace skullstation::actions {

// What the routes do. Each gives its answer; routes.cpp says who may ask.

// sign_in_actions.cpp
Response setup_state(Console&, Call&);
Response set_up(Console&, Call&);
Response sign_in(Console&, Call&);
Response who_am_i(Console&, Call&);
Response sign_out(Console&, Call&);
Response change_password(Console&, Call&);

// station_actions.cpp
Response station(Console&, Call&);
Response start(Console&, Call&);
Response confirm(Console&, Call&);
Response cancel(Console&, Call&);
Response reset(Console&, Call&);
Response hand(Console&, Call&);
Response scan_views(Console&, Call&);
Response preview(Console&, Call&);
Response check(Console&, Call&);
Response events(Console&, Call&);

// case_actions.cpp
Response cases(Console&, Call&);
Response show_case(Console&, Call&);
Response rerun(Console&, Call&);
Response hold(Console&, Call&);
Response prioritise(Console&, Call&);
Response approve(Console&, Call&);
Response retry(Console&, Call&);
Response cancel_job(Console&, Call&);
Response retry_delivery(Console&, Call&);
Response hold_delivery(Console&, Call&);
Response files(Console&, Call&);
Response file(Console&, Call&);

// account_actions.cpp
Response accounts(Console&, Call&);
Response add_account(Console&, Call&);
Response change_account(Console&, Call&);
Response audit(Console&, Call&);
Response audit_check(Console&, Call&);
Response description(Console&, Call&);

}  // namespace skullstation::actions

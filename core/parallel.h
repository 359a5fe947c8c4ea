#pragma once

#include <functional>

namespace skullstation {

/// 0 means as many as the machine has.
int thread_count(int requested);

/// Calls `work(index)` once for each index in [0, count), on `threads` threads (0: all), and
/// returns when all are done. Indices are handed out in order, so results written by index are
/// the same for any number of threads. The first exception thrown by `work` is thrown again here.
void parallel_for(int count, int threads, const std::function<void(int index)>& work);

}  // namespace skullstation

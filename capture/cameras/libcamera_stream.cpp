#include "capture/cameras/libcamera_stream.h"

#include <fmt/format.h>
#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "capture/cameras/libcamera_format.h"

namespace skullstation {
namespace {

tl::unexpected<Error> trouble(const std::string& camera, std::string_view doing, int error_number) {
  if (error_number == EBUSY) {
    return fail(ErrorKind::hardware, camera,
                fmt::format("the camera is in use by another program (while {})", doing),
                "close that program");
  }
  if (error_number == ENODEV) {
    return fail(ErrorKind::hardware, camera,
                fmt::format("the camera was unplugged (while {})", doing),
                "plug it in again and check its cable");
  }
  return fail(ErrorKind::hardware, camera,
              fmt::format("{} (while {})", std::strerror(error_number), doing));
}

/// Tells the exporter of a DMA buffer that the CPU reads it, so that caches agree with memory.
/// Memory that is no DMA buffer needs none of it and says so; that is of no interest.
void synchronise(int descriptor, std::uint64_t moment) {
  dma_buf_sync sync{};
  sync.flags = moment | DMA_BUF_SYNC_READ;
  ::ioctl(descriptor, DMA_BUF_IOCTL_SYNC, &sync);
}

}  // namespace

void CompletionQueue::completed(libcamera::Request* request) {
  const std::scoped_lock lock(mutex_);
  requests_.push_back(request);
  changed_.notify_all();
}

void CompletionQueue::disconnected() {
  const std::scoped_lock lock(mutex_);
  unplugged_ = true;
  changed_.notify_all();
}

CompletionQueue::Wake CompletionQueue::next(Instant deadline, std::stop_token stop,
                                            libcamera::Request*& request) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, stop, deadline, [this] { return unplugged_ || !requests_.empty(); });
  if (stop.stop_requested()) return Wake::stopped;
  if (unplugged_) return Wake::unplugged;
  if (requests_.empty()) return Wake::timed_out;
  request = requests_.front();
  requests_.pop_front();
  return Wake::request;
}

void CompletionQueue::clear() {
  const std::scoped_lock lock(mutex_);
  requests_.clear();
}

MappedFrameBuffers::~MappedFrameBuffers() {
  for (const Mapping& mapping : mappings_) ::munmap(mapping.address, mapping.length);
}

const MappedFrameBuffers::Mapping* MappedFrameBuffers::find(int descriptor) const {
  const auto found = std::find_if(
      mappings_.begin(), mappings_.end(),
      [descriptor](const Mapping& mapping) { return mapping.descriptor == descriptor; });
  return found == mappings_.end() ? nullptr : &*found;
}

Result<void> MappedFrameBuffers::map(const libcamera::FrameBuffer& buffer,
                                     const std::string& camera) {
  for (const auto& plane : buffer.planes()) {
    const int descriptor = plane.fd.get();
    if (find(descriptor) != nullptr) continue;
    std::size_t length = 0;  // of the whole memory: several planes may share it
    for (const auto& other : buffer.planes()) {
      if (other.fd.get() != descriptor) continue;
      length = std::max(length, std::size_t{other.offset} + other.length);
    }
    void* address = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, descriptor, 0);
    if (address == MAP_FAILED) return trouble(camera, "mapping its buffers", errno);
    mappings_.push_back({descriptor, address, length});
  }
  return {};
}

std::vector<std::uint8_t> MappedFrameBuffers::read(const libcamera::FrameBuffer& buffer,
                                                   const RawImageFormat& format) const {
  const std::vector<libcamera::FrameBuffer::Plane>& planes = buffer.planes();
  const auto filled = buffer.metadata().planes();
  // With several planes, the first ends where the decoder expects the second to begin.
  const std::size_t first_plane = format.stride_bytes * static_cast<std::size_t>(format.height);
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < planes.size() && i < filled.size(); ++i) {
    const Mapping* mapping = find(planes[i].fd.get());
    std::size_t used = std::min(filled[i].bytesused, planes[i].length);
    if (planes.size() > 1 && i == 0) used = std::min(used, first_plane);
    const auto* from = static_cast<const std::uint8_t*>(mapping->address) + planes[i].offset;
    synchronise(mapping->descriptor, DMA_BUF_SYNC_START);
    bytes.insert(bytes.end(), from, from + used);
    synchronise(mapping->descriptor, DMA_BUF_SYNC_END);
  }
  return bytes;
}

Result<std::unique_ptr<LibcameraStream>> LibcameraStream::open(
    std::shared_ptr<libcamera::Camera> camera, const LibcameraConfig& config) {
  std::unique_ptr<LibcameraStream> stream(new LibcameraStream(std::move(camera)));
  if (auto done = stream->acquire(); !done) return forward(done);
  if (auto done = stream->configure(config); !done) return forward(done);
  if (auto done = stream->make_requests(); !done) return forward(done);
  return stream;
}

LibcameraStream::~LibcameraStream() {
  stop();
  camera_->requestCompleted.disconnect(&completed_);
  camera_->disconnected.disconnect(&completed_);
  requests_.clear();
  allocator_.reset();
  if (acquired_) camera_->release();
}

Result<void> LibcameraStream::acquire() {
  if (const int outcome = camera_->acquire(); outcome < 0) {
    return trouble(camera_->id(), "acquiring it", -outcome);
  }
  acquired_ = true;
  camera_->requestCompleted.connect(&completed_, &CompletionQueue::completed);
  camera_->disconnected.connect(&completed_, &CompletionQueue::disconnected);
  return {};
}

Result<void> LibcameraStream::configure(const LibcameraConfig& config) {
  const std::string& id = camera_->id();
  configuration_ = camera_->generateConfiguration({libcamera::StreamRole::StillCapture});
  if (!configuration_ || configuration_->empty()) {
    return fail(ErrorKind::hardware, id, "the camera can't take still pictures",
                "use another camera");
  }
  libcamera::StreamConfiguration& stream = configuration_->at(0);
  const auto format = best_libcamera_format(stream.formats().pixelformats());
  if (!format) {
    return fail(ErrorKind::hardware, id, "the camera offers no pixel format that can be read",
                "use another camera");
  }
  stream.pixelFormat = *format;
  stream.bufferCount = static_cast<unsigned int>(config.buffers);
  if (config.size) {
    stream.size = {static_cast<unsigned int>(config.size->width),
                   static_cast<unsigned int>(config.size->height)};
  }
  const libcamera::Size asked = stream.size;
  if (configuration_->validate() == libcamera::CameraConfiguration::Invalid) {
    return fail(ErrorKind::hardware, id,
                fmt::format("the camera can't deliver {}", stream.toString()),
                "choose another size");
  }
  if (config.size && stream.size != asked && !config.allow_other_size) {
    return fail(ErrorKind::hardware, id,
                fmt::format("was asked for {} and answered with {}", asked.toString(),
                            stream.size.toString()),
                "choose a size that the camera offers");
  }
  if (!pixel_format_from_libcamera(stream.pixelFormat)) {
    return fail(ErrorKind::hardware, id,
                fmt::format("was asked for the pixel format {} and answered with {}",
                            format->toString(), stream.pixelFormat.toString()),
                "choose another size");
  }
  if (const int outcome = camera_->configure(configuration_.get()); outcome < 0) {
    return trouble(id, "setting the picture format", -outcome);
  }
  stream_ = stream.stream();
  format_ = image_format(stream);
  format_name_ = stream.pixelFormat.toString();
  return {};
}

Result<void> LibcameraStream::make_requests() {
  allocator_ = std::make_unique<libcamera::FrameBufferAllocator>(camera_);
  if (const int outcome = allocator_->allocate(stream_); outcome < 0) {
    return trouble(camera_->id(), "reserving buffers", -outcome);
  }
  for (const auto& buffer : allocator_->buffers(stream_)) {
    if (auto mapped = mapped_.map(*buffer, camera_->id()); !mapped) return mapped;
    std::unique_ptr<libcamera::Request> request = camera_->createRequest();
    if (!request) return trouble(camera_->id(), "making a request", ENOMEM);
    if (const int outcome = request->addBuffer(stream_, buffer.get()); outcome < 0) {
      return trouble(camera_->id(), "making a request", -outcome);
    }
    requests_.push_back(std::move(request));
  }
  return {};
}

void LibcameraStream::stop() {
  if (!running_) return;
  camera_->stop();  // cancels what is queued; all of it has completed when this returns
  completed_.clear();
  running_ = false;
}

Result<void> LibcameraStream::start(const libcamera::ControlList& controls) {
  stop();
  if (const int outcome = camera_->start(&controls); outcome < 0) {
    return trouble(camera_->id(), "starting the stream", -outcome);
  }
  running_ = true;
  for (const auto& request : requests_) {
    if (auto queued = give_back(request.get()); !queued) return queued;
  }
  return {};
}

Result<libcamera::Request*> LibcameraStream::next(Instant deadline, std::stop_token stop) {
  libcamera::Request* request = nullptr;
  switch (completed_.next(deadline, std::move(stop), request)) {
    case CompletionQueue::Wake::stopped:
      return fail(ErrorKind::cancelled, camera_->id(), "stopped while waiting for a picture");
    case CompletionQueue::Wake::unplugged:
      return trouble(camera_->id(), "waiting for a picture", ENODEV);
    case CompletionQueue::Wake::timed_out: return nullptr;
    case CompletionQueue::Wake::request: break;
  }
  // The pipeline cancels requests by itself when its sensor's stream stalls.
  if (request->status() == libcamera::Request::RequestCancelled) {
    return fail(ErrorKind::hardware, camera_->id(),
                "no picture: the camera timed out and cancelled it",
                "reopen the camera; if it happens again, check its cable");
  }
  return request;
}

const libcamera::FrameBuffer& LibcameraStream::buffer_of(const libcamera::Request& request) const {
  return *request.findBuffer(stream_);
}

Result<void> LibcameraStream::give_back(libcamera::Request* request) {
  request->reuse(libcamera::Request::ReuseBuffers);
  if (const int outcome = camera_->queueRequest(request); outcome < 0) {
    return trouble(camera_->id(), "queuing a request", -outcome);
  }
  return {};
}

}  // namespace skullstation

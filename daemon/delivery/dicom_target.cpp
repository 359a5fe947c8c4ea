// DICOM C-STORE over TLS, read back by C-GET. C-STORE's "Success" proves nothing: a receiver may
// answer it and keep other bytes that it has under the same UID, so the dataset that comes back is
// compared. One association for each object: short, and told apart in the receiver's log.

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmnet/scu.h>
#include <dcmtk/dcmtls/tlsscu.h>
#include <fmt/format.h>

#include <charconv>
#include <memory>

#include "daemon/delivery/dicom_dataset.h"
#include "daemon/delivery/dicom_dataset_sum.h"
#include "daemon/delivery/secret.h"
#include "daemon/delivery/target.h"

namespace skullstation {

namespace {

constexpr Uint32 answer_seconds = 60;
constexpr Sint32 connect_seconds = 20;

OFString of(const std::string& text) { return {text.c_str(), text.size()}; }

/// An association that keeps the sum of what comes back; with TLS or without.
template <class Scu>
class Association final : public Scu {
 public:
  std::optional<Result<std::string>> received;

 protected:
  OFCondition handleSTORERequest(const T_ASC_PresentationContextID, DcmDataset* object,
                                 OFBool& go_on, Uint16& status) override {
    const std::unique_ptr<DcmDataset> owned(object);
    go_on = OFTrue;
    status = STATUS_Success;
    if (object == nullptr) return DIMSE_NULLKEY;
    received = dicom_dataset_sum(*object, "what the receiver gave back");
    return EC_Normal;
  }
};

struct Peer {
  std::string host;
  Uint16 port = 104;
};

Result<Peer> peer_of(const std::string& address) {
  const std::string rest = address.substr(address.find("://") + 3);
  const auto colon = rest.rfind(':');
  Peer peer{rest.substr(0, colon), address.starts_with("dicoms") ? Uint16{2762} : Uint16{104}};
  if (colon == std::string::npos) return peer;
  const auto [end, error] =
      std::from_chars(rest.data() + colon + 1, rest.data() + rest.size(), peer.port);
  if (error != std::errc() || end != rest.data() + rest.size()) {
    return fail(ErrorKind::bad_input, address, "must end in a port's number");
  }
  return peer;
}

class DicomTarget final : public Target {
 public:
  DicomTarget(TargetConfig config, Peer peer)
      : config_(std::move(config)), peer_(std::move(peer)) {}

  Result<void> put(const DeliveryObject& object, const Progress& progress) override {
    return talk<Result<void>>([&](auto& scu) { return store(scu, object, progress); });
  }

  Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                               const Progress& progress) override {
    return talk<Result<std::optional<std::string>>>(
        [&](auto& scu) { return get(scu, object, progress); });
  }

  Result<bool> remove(const DeliveryObject&) override { return false; }

 private:
  template <class Answer, class Use>
  Answer talk(const Use& use) const {
    if (config_.address.starts_with("dicoms")) {
      Association<DcmTLSSCU> scu;
      for (const std::string& file : {config_.ca_file}) scu.addTrustedCertFile(of(file));
      scu.setPeerCertVerification(DCV_requireCertificate);
      if (!config_.key_file.empty()) {
        scu.enableAuthentication(of(config_.key_file), of(config_.certificate_file), "");
      }
      return use(scu);
    }
    Association<DcmSCU> scu;
    return use(scu);
  }

  template <class Scu>
  Result<void> connect(Scu& scu) const {
    scu.setAETitle(of(config_.calling_ae));
    scu.setPeerAETitle(of(config_.called_ae));
    scu.setPeerHostName(of(peer_.host));
    scu.setPeerPort(peer_.port);
    scu.setDIMSEBlockingMode(DIMSE_NONBLOCKING);
    scu.setDIMSETimeout(answer_seconds);
    scu.setACSETimeout(answer_seconds);
    scu.setConnectionTimeout(connect_seconds);
    OFCondition done = scu.initNetwork();
    if (done.bad()) {
      return fail(ErrorKind::bad_input, config_.address,
                  fmt::format("certificates or keys for it can't be used ({})", done.text()),
                  "check ca_file, certificate_file and key_file, then retry");
    }
    done = scu.negotiateAssociation();
    if (done.good()) return {};
    if (done == DUL_ASSOCIATIONREJECTED) {
      return fail(ErrorKind::bad_input, config_.address,
                  fmt::format("refuses to talk to {} as {} ({})", config_.calling_ae,
                              config_.called_ae, done.text()),
                  "have this station's AE title entered there, check called_ae, then retry");
    }
    if (done == NET_EC_NoAcceptablePresentationContexts) {
      return refused_kind();
    }
    return trouble(done);
  }

  tl::unexpected<Error> refused_kind() const {
    return fail(ErrorKind::bad_input, config_.address,
                "does not take (or give back) this kind of object",
                "it must accept it for C-STORE and C-GET; see its conformance statement");
  }

  tl::unexpected<Error> trouble(const OFCondition& condition) const {
    return fail(ErrorKind::hardware, config_.address,
                fmt::format("does not answer, or the connection was cut or not trusted ({})",
                            condition.text()),
                "see whether it runs and knows this station's AE title; with TLS whether both "
                "sides' certificates are valid");
  }

  static tl::unexpected<Error> stopped(const DeliveryObject& object) {
    return fail(ErrorKind::cancelled, object.name, "delivery was stopped on request");
  }

  template <class Scu>
  Result<void> store(Scu& scu, const DeliveryObject& object, const Progress& progress) const {
    if (progress.stop.stop_requested()) return stopped(object);
    const auto instance = read_dicom_instance(object.file);
    if (!instance) return forward(instance);
    OFList<OFString> syntaxes;
    syntaxes.push_back(of(instance->transfer_syntax_uid));
    scu.addPresentationContext(of(instance->sop_class_uid), syntaxes);
    if (auto connected = connect(scu); !connected) return connected;
    Uint16 status = 0;
    const OFCondition sent = scu.sendSTORERequest(0, object.file.c_str(), nullptr, status);
    scu.releaseAssociation();
    if (sent.bad()) return trouble(sent);
    const unsigned kind = status & 0xff00U;
    if (status == 0 || kind == 0xb000U || status == 0x0111U) return {};  // 0111: is there already
    if (kind == 0xa700U || status == 0x0110U) {
      return fail(ErrorKind::hardware, config_.address,
                  fmt::format("has no room or trouble of its own (DICOM status {:04X})", status),
                  "free some space there; it is tried again");
    }
    return fail(ErrorKind::bad_input, config_.address,
                fmt::format("refuses the object (DICOM status {:04X})", status),
                "its administrator can see the reason in its log; then retry");
  }

  template <class Scu>
  Result<std::optional<std::string>> get(Scu& scu, const DeliveryObject& object,
                                         const Progress& progress) const {
    if (progress.stop.stop_requested()) return stopped(object);
    const auto instance = read_dicom_instance(object.file);
    if (!instance) return forward(instance);
    OFList<OFString> stored_as;
    stored_as.push_back(of(instance->transfer_syntax_uid));
    OFList<OFString> plain;
    plain.push_back(UID_LittleEndianExplicitTransferSyntax);
    plain.push_back(UID_LittleEndianImplicitTransferSyntax);
    scu.addPresentationContext(UID_FINDStudyRootQueryRetrieveInformationModel, plain);
    scu.addPresentationContext(UID_GETStudyRootQueryRetrieveInformationModel, plain);
    scu.addPresentationContext(of(instance->sop_class_uid), stored_as, ASC_SC_ROLE_SCP);
    if (auto connected = connect(scu); !connected) return forward(connected);
    auto sum = ask(scu, *instance);
    scu.releaseAssociation();
    return sum;
  }

  /// Is it there (C-FIND), and if so: what is it (C-GET)? Receivers answer C-GET for what they
  /// don't have with an error, or with nothing.
  template <class Scu>
  Result<std::optional<std::string>> ask(Scu& scu, const DicomInstance& instance) const {
    const auto context_of = [&](const char* model) {
      return scu.findPresentationContextID(model, "");
    };
    const auto find = context_of(UID_FINDStudyRootQueryRetrieveInformationModel);
    const auto get = context_of(UID_GETStudyRootQueryRetrieveInformationModel);
    if (find == 0 || get == 0) return refused_kind();
    DcmDataset keys;
    keys.putAndInsertString(DCM_QueryRetrieveLevel, "IMAGE");
    keys.putAndInsertString(DCM_StudyInstanceUID, instance.study_uid.c_str());
    keys.putAndInsertString(DCM_SeriesInstanceUID, instance.series_uid.c_str());
    keys.putAndInsertString(DCM_SOPInstanceUID, instance.instance_uid.c_str());
    OFList<QRResponse*> matches;
    if (const OFCondition asked = scu.sendFINDRequest(find, &keys, &matches); asked.bad()) {
      return trouble(asked);
    }
    bool is_there = false;
    Uint16 status = 0xffff;
    for (QRResponse* match : matches) {
      status = match->m_status;
      is_there = is_there || match->m_dataset != nullptr;
      delete match;
    }
    if (status != 0) return cant_tell(status);
    if (!is_there) return std::optional<std::string>();
    OFList<RetrieveResponse*> responses;
    const OFCondition asked = scu.sendCGETRequest(get, &keys, &responses);
    for (RetrieveResponse* response : responses) {
      status = response->m_status;
      delete response;
    }
    if (asked.bad()) return trouble(asked);
    if (!scu.received) return cant_tell(status);
    if (!*scu.received) return forward(*scu.received);
    return std::optional<std::string>(**scu.received);
  }

  tl::unexpected<Error> cant_tell(Uint16 status) const {
    return fail(ErrorKind::hardware, config_.address,
                fmt::format("does not give the object back (DICOM status {:04X})", status),
                "C-FIND and C-GET must be allowed there for this station");
  }

  TargetConfig config_;
  Peer peer_;
};

}  // namespace

Result<std::unique_ptr<Target>> open_dicom_target(const TargetConfig& config) {
  silence_dcmtk();
  const auto peer = peer_of(config.address);
  if (!peer) return forward(peer);
  if (!config.key_file.empty()) {
    if (const auto safe = check_secret_file(config.key_file); !safe) return forward(safe);
  }
  return std::make_unique<DicomTarget>(config, *peer);
}

}  // namespace skullstation

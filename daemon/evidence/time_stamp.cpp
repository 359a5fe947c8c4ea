#include "daemon/evidence/time_stamp.h"

#include <fmt/format.h>
#include <openssl/ess.h>
#include <openssl/ts.h>

#include <algorithm>
#include <array>
#include <optional>

#include "daemon/evidence/certificate.h"

namespace skullstation {

namespace {

using QueryHandle = std::unique_ptr<TS_REQ, OpensslFree<TS_REQ_free>>;
using AnswerHandle = std::unique_ptr<TS_RESP, OpensslFree<TS_RESP_free>>;
using ImprintHandle = std::unique_ptr<TS_MSG_IMPRINT, OpensslFree<TS_MSG_IMPRINT_free>>;
using AlgorithmHandle = std::unique_ptr<X509_ALGOR, OpensslFree<X509_ALGOR_free>>;
using NumberHandle = std::unique_ptr<ASN1_INTEGER, OpensslFree<ASN1_INTEGER_free>>;
using BigNumberHandle = std::unique_ptr<BIGNUM, OpensslFree<BN_free>>;

using EssHandle = std::unique_ptr<ESS_SIGNING_CERT, OpensslFree<ESS_SIGNING_CERT_free>>;
using EssV2Handle = std::unique_ptr<ESS_SIGNING_CERT_V2, OpensslFree<ESS_SIGNING_CERT_V2_free>>;

using Digest = std::array<unsigned char, 32>;

Digest sha256_of(std::string_view message) {
  Digest digest{};
  EVP_Digest(message.data(), message.size(), digest.data(), nullptr, EVP_sha256(), nullptr);
  return digest;
}

tl::unexpected<Error> no_stamp(std::string what, std::string advice = {}) {
  ERR_clear_error();
  return fail(ErrorKind::bad_input, "time stamp", std::move(what), std::move(advice));
}

AnswerHandle answer_of(std::string_view der) {
  const BioHandle bio = reading_from(der);
  return AnswerHandle(d2i_TS_RESP_bio(bio.get(), nullptr));
}

/// The one signer's certificate, which lies in the token; null if there is none.
X509* signer_of(PKCS7* token) {
  STACK_OF(X509)* signers = PKCS7_get0_signers(token, nullptr, 0);
  X509* signer = sk_X509_num(signers) == 1 ? sk_X509_value(signers, 0) : nullptr;
  sk_X509_free(signers);
  return signer;
}

/// The signed attribute's bytes, in DER; empty if there is none.
std::string signed_attribute(PKCS7* token, int nid) {
  PKCS7_SIGNER_INFO* signature = sk_PKCS7_SIGNER_INFO_value(PKCS7_get_signer_info(token), 0);
  const ASN1_TYPE* value = PKCS7_get_signed_attribute(signature, nid);
  if (value == nullptr || value->type != V_ASN1_SEQUENCE) return {};
  return {reinterpret_cast<const char*>(value->value.sequence->data),
          static_cast<std::size_t>(value->value.sequence->length)};
}

/// Does the signature name this certificate by its sum (RFC 3161, 2.4.2; RFC 5816)? Otherwise
/// another one with the same key could stand in the token.
bool names(PKCS7* token, X509* certificate) {
  const std::string first = signed_attribute(token, NID_id_smime_aa_signingCertificate);
  const std::string second = signed_attribute(token, NID_id_smime_aa_signingCertificateV2);
  const auto* bytes = reinterpret_cast<const unsigned char*>(first.data());
  const EssHandle by_sha1(d2i_ESS_SIGNING_CERT(nullptr, &bytes, static_cast<long>(first.size())));
  bytes = reinterpret_cast<const unsigned char*>(second.data());
  const EssV2Handle by_sum(
      d2i_ESS_SIGNING_CERT_V2(nullptr, &bytes, static_cast<long>(second.size())));
  STACK_OF(X509)* chain = sk_X509_new_null();
  sk_X509_push(chain, certificate);
  const bool named = OSSL_ESS_check_signing_certs(by_sha1.get(), by_sum.get(), chain, 1) > 0;
  sk_X509_free(chain);
  ERR_clear_error();
  return named;
}

bool is_of(TS_TST_INFO* info, std::string_view message) {
  TS_MSG_IMPRINT* imprint = TS_TST_INFO_get_msg_imprint(info);
  const ASN1_OBJECT* algorithm = nullptr;
  X509_ALGOR_get0(&algorithm, nullptr, nullptr, TS_MSG_IMPRINT_get_algo(imprint));
  const ASN1_OCTET_STRING* stamped = TS_MSG_IMPRINT_get_msg(imprint);
  const Digest digest = sha256_of(message);
  return OBJ_obj2nid(algorithm) == NID_sha256 &&
         ASN1_STRING_length(stamped) == static_cast<int>(digest.size()) &&
         std::equal(digest.begin(), digest.end(), ASN1_STRING_get0_data(stamped));
}

/// The nonce keeps an old answer from being taken for a new one.
bool answers(TS_TST_INFO* info, std::string_view query) {
  const BioHandle bio = reading_from(query);
  const QueryHandle asked(d2i_TS_REQ_bio(bio.get(), nullptr));
  if (!asked) return false;
  const ASN1_INTEGER* nonce = TS_TST_INFO_get_nonce(info);
  return nonce != nullptr && ASN1_INTEGER_cmp(nonce, TS_REQ_get_nonce(asked.get())) == 0;
}

std::string hexadecimal(const ASN1_INTEGER* number) {
  const BigNumberHandle value(ASN1_INTEGER_to_BN(number, nullptr));
  char* digits = BN_bn2hex(value.get());
  std::string text = digits;
  OPENSSL_free(digits);
  return text;
}

}  // namespace

std::string time_stamp_query(std::string_view message) {
  const AlgorithmHandle algorithm(X509_ALGOR_new());
  X509_ALGOR_set0(algorithm.get(), OBJ_nid2obj(NID_sha256), V_ASN1_NULL, nullptr);
  Digest digest = sha256_of(message);
  const ImprintHandle imprint(TS_MSG_IMPRINT_new());
  TS_MSG_IMPRINT_set_algo(imprint.get(), algorithm.get());
  TS_MSG_IMPRINT_set_msg(imprint.get(), digest.data(), static_cast<int>(digest.size()));
  const BigNumberHandle random(BN_new());
  BN_rand(random.get(), 64, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY);
  const NumberHandle nonce(BN_to_ASN1_INTEGER(random.get(), nullptr));
  const QueryHandle query(TS_REQ_new());
  TS_REQ_set_version(query.get(), 1);
  TS_REQ_set_msg_imprint(query.get(), imprint.get());
  TS_REQ_set_nonce(query.get(), nonce.get());
  TS_REQ_set_cert_req(query.get(), 1);
  const BioHandle der = collecting();
  i2d_TS_REQ_bio(der.get(), query.get());
  return collected(der);
}

Result<TimeStamp> read_time_stamp(std::string_view answer, std::string_view message,
                                  std::string_view query) {
  const AnswerHandle response = answer_of(answer);
  if (!response) return no_stamp("is no answer of a time-stamping authority (RFC 3161)");
  const long status =
      ASN1_INTEGER_get(TS_STATUS_INFO_get0_status(TS_RESP_get_status_info(response.get())));
  PKCS7* token = TS_RESP_get_token(response.get());
  TS_TST_INFO* info = TS_RESP_get_tst_info(response.get());
  if ((status != TS_STATUS_GRANTED && status != TS_STATUS_GRANTED_WITH_MODS) || token == nullptr ||
      info == nullptr) {
    return no_stamp(fmt::format("the authority refused (status {})", status),
                    "ask it whether it takes SHA-256 and requests without a policy");
  }
  if (!is_of(info, message)) return no_stamp("is of other bytes");
  if (!query.empty() && !answers(info, query)) {
    return no_stamp("is no answer to this request (its nonce is another)");
  }
  // The certificate counts that the token holds; whether it leads to a trusted one is asked later.
  if (PKCS7_verify(token, nullptr, nullptr, nullptr, nullptr, PKCS7_NOVERIFY) != 1) {
    return no_stamp(fmt::format("its signature is not valid ({})", openssl_reason()));
  }
  X509* signer = signer_of(token);
  if (signer == nullptr || X509_check_purpose(signer, X509_PURPOSE_TIMESTAMP_SIGN, 0) != 1) {
    return no_stamp("was signed by a certificate that may not stamp times");
  }
  if (!names(token, signer)) return no_stamp("does not name the certificate that signed it");
  const auto time = utc_of(TS_TST_INFO_get_time(info));
  if (!time) return no_stamp("holds no time");
  return TimeStamp{subject_of(signer), to_iso8601(*time), *time,
                   hexadecimal(TS_TST_INFO_get_serial(info))};
}

Result<void> trusts_time_stamp(const Trust& trust, std::string_view answer) {
  const AnswerHandle response = answer_of(answer);
  PKCS7* token = response ? TS_RESP_get_token(response.get()) : nullptr;
  TS_TST_INFO* info = response ? TS_RESP_get_tst_info(response.get()) : nullptr;
  X509* signer = token != nullptr ? signer_of(token) : nullptr;
  const auto time = info != nullptr ? utc_of(TS_TST_INFO_get_time(info)) : std::nullopt;
  if (signer == nullptr || !time) return no_stamp("can't be read");
  return leads_to_trusted(trust, signer, token->d.sign->cert, *time, X509_PURPOSE_TIMESTAMP_SIGN);
}

}  // namespace skullstation

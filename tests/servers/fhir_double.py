"""A FHIR R4 endpoint: transactions with ifNoneExist, search by identifier, what R4 demands of the
resources that we send.

usage: fhir_double.py PORT FOLDER TOKEN
"""
import base64
import hashlib
import json
import socketserver
import sys
import urllib.parse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

port, folder, token = int(sys.argv[1]), sys.argv[2], sys.argv[3]
held = {}

ALLOWED = {
    "Patient": {"resourceType", "identifier", "name", "gender", "deceasedBoolean"},
    "DocumentReference": {"resourceType", "identifier", "status", "type", "description", "subject",
                          "content"},
}


def fault(resource):
    kind = resource.get("resourceType")
    if kind not in ALLOWED:
        return "unknown resource %s" % kind
    extra = set(resource) - ALLOWED[kind]
    if extra:
        return "unknown elements %s" % sorted(extra)
    if kind == "Patient":
        if resource["gender"] not in ("male", "female", "other", "unknown"):
            return "gender"
        return None
    if resource.get("status") not in ("current", "superseded", "entered-in-error"):
        return "status"
    if not resource.get("content"):
        return "content is missing"
    for content in resource["content"]:
        attachment = content["attachment"]
        if "data" in attachment:
            data = base64.b64decode(attachment["data"], validate=True)
            if len(data) != attachment["size"]:
                return "size"
            if base64.b64encode(hashlib.sha1(data).digest()).decode() != attachment["hash"]:
                return "hash"
    return None


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def log_message(self, *_):
        pass

    def answer(self, status, resource):
        body = json.dumps(resource).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/fhir+json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def refuse(self, status, why):
        self.answer(status, {"resourceType": "OperationOutcome",
                             "issue": [{"severity": "error", "code": "invalid",
                                        "diagnostics": why}]})

    def allowed(self):
        if self.headers.get("Authorization") == "Bearer " + token:
            return True
        self.refuse(401, "no valid token")
        return False

    def matching(self, kind, identifier):
        return [r for (k, _), r in held.items() if k == kind and any(
            i["system"] + "|" + i["value"] == identifier for i in r.get("identifier", []))]

    def do_POST(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        if not self.allowed():
            return
        bundle = json.loads(body)
        if bundle.get("resourceType") != "Bundle" or bundle.get("type") != "transaction":
            return self.refuse(400, "no transaction")
        urls = {}
        for entry in bundle["entry"]:
            why = fault(entry["resource"])
            if why:
                return self.refuse(422, why)
        for entry in bundle["entry"]:
            resource = entry["resource"]
            kind = resource["resourceType"]
            query = urllib.parse.parse_qs(entry["request"].get("ifNoneExist", ""))
            same = self.matching(kind, query["identifier"][0]) if query else []
            if not same:
                resource["id"] = str(len(held) + 1)
                resource["meta"] = {"versionId": "1"}
                held[(kind, resource["id"])] = resource
                same = [resource]
            urls[entry["fullUrl"]] = "%s/%s" % (kind, same[0]["id"])
        for resource in held.values():
            if "subject" in resource:
                reference = resource["subject"]["reference"]
                resource["subject"]["reference"] = urls.get(reference, reference)
        self.answer(200, {"resourceType": "Bundle", "type": "transaction-response"})

    def do_GET(self):
        if not self.allowed():
            return
        parsed = urllib.parse.urlsplit(self.path)
        kind = parsed.path.rsplit("/", 1)[-1]
        wanted = urllib.parse.parse_qs(parsed.query).get("identifier", [""])[0]
        found = self.matching(kind, wanted) if wanted else [r for (k, _), r in held.items()
                                                            if k == kind]
        self.answer(200, {"resourceType": "Bundle", "type": "searchset", "total": len(found),
                          "entry": [{"resource": r} for r in found]})

    def do_DELETE(self):
        if not self.allowed():
            return
        kind, number = self.path.rsplit("/", 2)[-2:]
        held.pop((kind, number), None)
        self.answer(200, {"resourceType": "OperationOutcome"})


class Server(ThreadingHTTPServer):
    def server_bind(self):  # without asking for this machine's name
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = self.server_address


Server(("127.0.0.1", port), Handler).serve_forever()

"""An S3 that keeps objects in memory and recomputes every SigV4 signature by its own code.

usage: s3_double.py PORT FOLDER SECRET     (access key TESTKEY, region lab, bucket "case")
"""
import hashlib
import hmac
import socketserver
import sys
import urllib.parse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

port, folder, secret = int(sys.argv[1]), sys.argv[2], sys.argv[3]
objects = {}


def sign(key, text):
    return hmac.new(key, text.encode(), hashlib.sha256).digest()


def expected_signature(method, path, headers, signed, date, body_sha):
    parsed = urllib.parse.urlsplit(path)
    # AWS: each byte but the unreserved ones as %XX, the path's slashes as they are.
    canonical_path = urllib.parse.quote(urllib.parse.unquote(parsed.path), safe="/-_.~")
    canonical = "\n".join(
        [method, canonical_path, parsed.query]
        + ["%s:%s" % (h, " ".join(headers[h].split())) for h in signed]
        + ["", ";".join(signed), body_sha])
    scope = "%s/lab/s3/aws4_request" % date[:8]
    text = "\n".join(["AWS4-HMAC-SHA256", date, scope,
                      hashlib.sha256(canonical.encode()).hexdigest()])
    key = ("AWS4" + secret).encode()
    for part in (date[:8], "lab", "s3", "aws4_request"):
        key = sign(key, part)
    return hmac.new(key, text.encode(), hashlib.sha256).hexdigest()


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def log_message(self, *_):
        pass

    def answer(self, status, body=b""):
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def handle_one(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        headers = {k.lower(): v for k, v in self.headers.items()}
        fields = dict(part.strip().split("=", 1) for part in
                      headers.get("authorization", "").replace("AWS4-HMAC-SHA256", "").split(",")
                      if "=" in part)
        signed = fields.get("SignedHeaders", "").split(";")
        if not fields.get("Credential", "").startswith("TESTKEY/") or "host" not in signed:
            return self.answer(403, b"<Code>AccessDenied</Code>")
        body_sha = headers.get("x-amz-content-sha256", "")
        if body_sha != hashlib.sha256(body).hexdigest():
            return self.answer(400, b"<Code>XAmzContentSHA256Mismatch</Code>")
        wanted = expected_signature(self.command, self.path, headers, signed,
                                    headers.get("x-amz-date", ""), body_sha)
        if not hmac.compare_digest(wanted, fields.get("Signature", "")):
            return self.answer(403, b"<Code>SignatureDoesNotMatch</Code>")
        name = urllib.parse.unquote(self.path)
        if not name.startswith("/case/"):
            return self.answer(404, b"<Code>NoSuchBucket</Code>")
        if self.command == "PUT":
            if "503" in name:
                return self.answer(503)
            if headers.get("if-none-match") == "*" and name in objects:
                return self.answer(412, b"<Code>PreconditionFailed</Code>")
            objects[name] = body
            return self.answer(200)
        if name not in objects:
            return self.answer(404, b"<Code>NoSuchKey</Code>")
        if self.command == "DELETE":
            del objects[name]
            return self.answer(204)
        return self.answer(200, objects[name])

    do_GET = do_PUT = do_DELETE = handle_one


class Server(ThreadingHTTPServer):
    def server_bind(self):  # without asking for this machine's name
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = self.server_address


Server(("127.0.0.1", port), Handler).serve_forever()

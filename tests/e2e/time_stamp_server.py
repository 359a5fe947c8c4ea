# A time-stamping authority (RFC 3161) over HTTP on loopback, played by `openssl ts`.
# Usage: time_stamp_server.py FOLDER, with tsa.cnf, tsa.key and tsa.pem in it (TimeStampAuthority).
# Writes its port to FOLDER/port; answers POST / with stamps and POST /busy with 503. Ends by itself.
import http.server
import os
import subprocess
import sys
import threading

folder = sys.argv[1]


class Authority(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        query = self.rfile.read(int(self.headers["Content-Length"]))
        if self.path == "/busy" or self.headers["Content-Type"] != "application/timestamp-query":
            self.send_error(503)
            return
        with open(os.path.join(folder, "query.tsq"), "wb") as file:
            file.write(query)
        answer = subprocess.run(
            ["openssl", "ts", "-reply", "-config", "tsa.cnf", "-queryfile", "query.tsq", "-inkey",
             "tsa.key", "-signer", "tsa.pem"], cwd=folder, capture_output=True, check=True).stdout
        self.send_response(200)
        self.send_header("Content-Type", "application/timestamp-reply")
        self.send_header("Content-Length", str(len(answer)))
        self.end_headers()
        self.wfile.write(answer)

    def log_message(self, *_):
        pass


server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Authority)
threading.Timer(120, lambda: os._exit(0)).start()
with open(os.path.join(folder, "port.new"), "w") as file:
    file.write(str(server.server_port))
os.rename(os.path.join(folder, "port.new"), os.path.join(folder, "port"))
server.serve_forever()

//! `agglo view`: what is served and to whom, the links, Rerun; the Python page of docs/viewers.md.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};

use super::{Folder, python};

const SCENE: &str = r#"{
    "duration": 0.05,
    "particles": { "list": [
        { "position": [0.3, 0.5, 0.5], "velocity": [1, 0, 0], "radius": 0.05, "mass": 1.0, "temperature": 300.0 },
        { "position": [0.7, 0.5, 0.5], "velocity": [-1, 0, 0], "radius": 0.05, "mass": 1.0, "temperature": 310.0 }
    ] },
    "thermal": { "heat_capacity": 1000.0, "convection": { "coefficient": 1.0, "ambient": 300.0 } }
}"#;

/// A server, ended with the test.
struct Server {
    child: Child,
    stdout: BufReader<std::process::ChildStdout>,
    text: String,
    port: u16,
    token: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        _ = self.child.kill();
        _ = self.child.wait();
    }
}

impl Server {
    fn start(folder: &Folder, arguments: &[&str]) -> Self {
        let mut command = folder.command(&[&["view"], arguments].concat());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut text = String::new();
        while !text.contains("Ctrl-C") {
            assert!(stdout.read_line(&mut text).unwrap() > 0, "it ended: {text}");
        }
        let url = text.split_once("http://127.0.0.1:").unwrap().1;
        let (port, rest) = url.split_once('/').unwrap();
        let (token, _) = rest.split_once('/').unwrap();
        let (port, token) = (port.parse().unwrap(), token.to_owned());
        Self { child, stdout, text, port, token }
    }

    /// Sends a request with these header lines; the answer's status, head in lower case, and body.
    fn ask(&self, line: &str, headers: &[&str]) -> (u16, String, Vec<u8>) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let headers: String = headers.iter().map(|header| format!("{header}\r\n")).collect();
        write!(stream, "{line} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap();
        let head = String::from_utf8(answer[..end].to_vec()).unwrap().to_lowercase();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), head, answer[end + 4..].to_vec())
    }

    fn host(&self) -> String {
        format!("Host: 127.0.0.1:{}", self.port)
    }

    fn log(&self) -> String {
        format!("/{}/run.mcap", self.token)
    }
}

fn recorded() -> Folder {
    let folder = Folder::with(SCENE);
    folder.agglo(&["run", "scene.json", "-o", "run.mcap"]).code(0);
    folder
}

#[test]
fn a_log_is_served_whole_and_in_ranges() {
    let folder = recorded();
    let server = Server::start(&folder, &["run.mcap"]);
    let (log, host, path) = (folder.read("run.mcap"), server.host(), server.log());
    let (status, head, body) = server.ask(&format!("GET {path}"), &[&host]);
    assert_eq!((status, body.as_slice()), (200, log.as_slice()));
    for header in [
        "accept-ranges: bytes",
        "cache-control: no-store",
        "x-content-type-options: nosniff",
        "referrer-policy: no-referrer",
        &format!("content-length: {}", log.len()),
    ] {
        assert!(head.contains(header), "{header}: {head}");
    }
    let (status, head, body) = server.ask(&format!("HEAD {path}"), &[&host]);
    assert_eq!((status, body.len()), (200, 0));
    assert!(head.contains(&format!("content-length: {}", log.len())), "{head}");

    let n = log.len();
    for (range, expected) in [
        ("bytes=0-7".to_owned(), &log[..8]),
        ("bytes=10-19".to_owned(), &log[10..20]),
        (format!("bytes={}-", n - 8), &log[n - 8..]),
        ("bytes=-8".to_owned(), &log[n - 8..]),
        (format!("bytes=5-{}", n + 100), &log[5..]),
    ] {
        let (status, head, body) = server.ask(&format!("GET {path}"), &[&host, &format!("Range: {range}")]);
        assert_eq!((status, body.as_slice()), (206, expected), "{range}: {head}");
        assert!(head.contains("content-range: bytes "), "{head}");
    }
    let (status, head, _) = server.ask(&format!("GET {path}"), &[&host, &format!("Range: bytes={n}-")]);
    assert_eq!(status, 416, "{head}");

    let (status, head, layout) = server.ask(&format!("GET /{}/layout.json", server.token), &[&host]);
    assert!(status == 200 && head.contains("content-type: application/json"), "{head}");
    let layout: serde_json::Value = serde_json::from_slice(&layout).unwrap();
    assert!(layout["configById"]["Plot!temperature"].is_object() && layout["configById"]["Plot!clusters"].is_null());
}

#[test]
fn nothing_else_is_served_and_to_nobody_else() {
    let folder = recorded();
    folder.write("secret.txt", "secret");
    let server = Server::start(&folder, &["run.mcap", "--allow-origin", "http://viewer.test:9090/"]);
    let (host, path, token) = (server.host(), server.log(), server.token.clone());
    let wrong = "0".repeat(32);
    for other in [
        "/".to_owned(),
        format!("/{token}"),
        format!("/{token}/"),
        format!("/{token}/secret.txt"),
        format!("/{token}/scene.json"),
        format!("/{token}/../secret.txt"),
        format!("/{token}/run.mcap/../secret.txt"),
        format!("/{token}/%2e%2e/secret.txt"),
        format!("/{token}/run.mcap/"),
        format!("/{token}/run.mcap%00"),
        format!("//{token}/run.mcap"),
        format!("/{wrong}/run.mcap"),
        format!("/{wrong}/layout.json"),
        format!("/{}/run.mcap", &token[..31]),
        "/run.mcap".to_owned(),
        "/layout.json".to_owned(),
        "/etc/passwd".to_owned(),
    ] {
        let (status, _, body) = server.ask(&format!("GET {other}"), &[&host]);
        assert!(status == 404 && body.is_empty(), "{other}: {status}, {} bytes", body.len());
    }
    for method in ["POST", "PUT", "DELETE", "PATCH", "TRACE"] {
        let (status, _, body) = server.ask(&format!("{method} {path}"), &[&host, "Content-Length: 0"]);
        assert!(status == 405 && body.is_empty(), "{method}: {status}");
    }
    let port = server.port;
    for other in
        ["evil.test", "evil.test:80", &format!("evil.test:{port}"), "127.0.0.1", &format!("0.0.0.0:{port}"), ""]
    {
        let (status, _, body) = server.ask(&format!("GET {path}"), &[&format!("Host: {other}")]);
        assert!(status == 421 && body.is_empty(), "Host {other}: {status}");
    }
    let (status, ..) = server.ask(&format!("GET {path}"), &[&format!("Host: localhost:{port}")]);
    assert_eq!(status, 200);

    // The named pages may read, others not even blindly.
    for origin in ["https://app.foxglove.dev", "https://lichtblick-suite.github.io", "http://viewer.test:9090"] {
        assert!(server.text.contains(origin), "{origin} is named");
        let header = format!("Origin: {origin}");
        let (status, head, _) = server.ask(&format!("GET {path}"), &[&host, &header, "Range: bytes=0-7"]);
        assert_eq!(status, 206);
        assert!(head.contains(&format!("access-control-allow-origin: {origin}")), "{head}");
        assert!(head.contains("access-control-expose-headers:") && head.contains("content-range"), "{head}");
        let asked = ["Access-Control-Request-Method: GET", "Access-Control-Request-Headers: range"];
        let network = "Access-Control-Request-Private-Network: true";
        let (status, head, _) = server.ask(&format!("OPTIONS {path}"), &[&host, &header, asked[0], asked[1], network]);
        assert_eq!(status, 200, "{head}");
        for allowed in ["access-control-allow-methods: get,head", "access-control-allow-private-network: true", "range"]
        {
            assert!(head.contains(allowed), "{allowed}: {head}");
        }
    }
    for origin in ["https://evil.test", "null", "https://app.foxglove.dev.evil.test", "http://app.foxglove.dev"] {
        let (status, head, body) = server.ask(&format!("GET {path}"), &[&host, &format!("Origin: {origin}")]);
        assert!(status == 403 && body.is_empty() && !head.contains("access-control-allow-origin"), "{origin}: {head}");
    }
}

#[test]
fn it_is_on_loopback_and_ends_quietly() {
    let folder = recorded();
    let mut server = Server::start(&folder, &["run.mcap"]);
    for part in [
        &format!("http://127.0.0.1:{}/{}/run.mcap", server.port, server.token),
        "https://lichtblick-suite.github.io/lichtblick/?ds=remote-file&ds.url=http%3A%2F%2F127.0.0.1%3A",
        "&layoutUrl=http%3A%2F%2F127.0.0.1%3A",
        "https://app.foxglove.dev/~/view?ds=remote-file&ds.url=",
        "import the layout",
        "desktop:",
        "--rerun",
    ] {
        assert!(server.text.contains(part), "{part}: {}", server.text);
    }
    let listening = std::fs::read_to_string("/proc/net/tcp").unwrap_or_default();
    // Addresses are little-endian hexadecimal numbers; 0A is a socket that listens.
    let entry = format!(":{:04X} 00000000:0000 0A", server.port);
    let ours: Vec<_> = listening.lines().filter(|line| line.contains(&entry)).collect();
    assert!(ours.iter().all(|line| line.contains("0100007F:")), "{ours:?}");
    // A port that is taken is said to be.
    folder
        .agglo(&["view", "run.mcap", "--port", &server.port.to_string()])
        .code(2)
        .says(&["cannot serve on", "--port 0"]);

    _ = std::process::Command::new("kill").args(["-INT", &server.child.id().to_string()]).status();
    assert_eq!(server.child.wait().unwrap().code(), Some(0));
    let mut rest = String::new();
    server.stdout.read_to_string(&mut rest).unwrap();
    server.child.stderr.take().unwrap().read_to_string(&mut rest).unwrap();
    assert_eq!(rest, "");
}

#[test]
fn addresses_differ_from_run_to_run() {
    let folder = recorded();
    let tokens = [0, 1].map(|_| Server::start(&folder, &["run.mcap"]).token.clone());
    assert!(tokens[0] != tokens[1] && tokens.iter().all(|token| token.len() == 32), "{tokens:?}");
}

#[test]
fn a_damaged_log_is_shown_and_said_to_be() {
    let folder = recorded();
    let log = folder.read("run.mcap");
    folder.write("cut.mcap", &log[..log.len() - 100]);
    let mut server = Server::start(&folder, &["cut.mcap"]);
    _ = std::process::Command::new("kill").args(["-TERM", &server.child.id().to_string()]).status();
    assert_eq!(server.child.wait().unwrap().code(), Some(3));
    let mut said = String::new();
    server.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(said.contains("damaged") && said.contains("agglo recover"), "{said}");
    folder.agglo(&["view", "nothing.mcap"]).code(2);
    folder.agglo(&["view", "scene.json"]).code(2);
}

#[test]
fn python_reads_a_log_by_ranges() {
    let Some(python) = python("python_reads_a_log_by_ranges", "mcap_protobuf, mcap") else { return };
    let folder = recorded();
    let server = Server::start(&folder, &["run.mcap"]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/viewers/view_check.py");
    let url = format!("http://127.0.0.1:{}{}", server.port, server.log());
    let output = std::process::Command::new(python).arg(script).arg(url).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Stands for Rerun: writes down how it was called, and makes the files that it is asked for.
#[cfg(unix)]
fn fake_rerun(folder: &Folder, script: &str) -> String {
    use std::os::unix::fs::PermissionsExt;
    folder.write("rerun", format!("#!/bin/sh\necho \"$@\" >> calls.txt\n{script}\n"));
    std::fs::set_permissions(folder.path("rerun"), std::fs::Permissions::from_mode(0o755)).unwrap();
    folder.path("rerun").display().to_string()
}

#[cfg(unix)]
#[test]
fn rerun_gets_the_log_with_a_blueprint() {
    let folder = recorded();
    let keep = r#"for last; do :; done; case "$1" in rrd) cp "$last" kept.rbl;; esac"#;
    let program = fake_rerun(&folder, keep);
    let ran = folder.command(&["view", "run.mcap", "--rerun"]).env("AGGLO_RERUN", &program).output().unwrap();
    super::Ran::from(ran).code(0);
    let calls = String::from_utf8(folder.read("calls.txt")).unwrap();
    let calls: Vec<_> = calls.lines().collect();
    assert!(calls[0].starts_with("mcap convert --timeline-type duration --application-id agglo -o "), "{calls:?}");
    assert!(calls[0].ends_with(" run.mcap") && calls[1].starts_with("rrd merge -o "), "{calls:?}");
    assert!(calls[2].starts_with("--bind 127.0.0.1 ") && calls[2].ends_with("run.rrd"), "{calls:?}");
    assert_eq!(calls.len(), 3);
    // The particles' radius stands in the blueprint, of the variant with temperatures and without clusters.
    let blueprint = folder.read("kept.rbl");
    let holds = |bytes: &[u8]| blueprint.windows(bytes.len()).any(|found| found == bytes);
    assert!(holds(&0.05_f32.to_le_bytes()) && holds(b"Temperature [K]") && !holds(b"/clusters"));

    let program = fake_rerun(&folder, "echo no such thing >&2; exit 4");
    let ran = folder.command(&["view", "run.mcap", "--rerun"]).env("AGGLO_RERUN", &program).output().unwrap();
    super::Ran::from(ran).code(1).says(&["no such thing", "failed"]);
    let ran = folder.command(&["view", "run.mcap", "--rerun"]).env("AGGLO_RERUN", "/nowhere/rerun").output().unwrap();
    super::Ran::from(ran).code(2).says(&["pip install rerun-sdk", "AGGLO_RERUN"]);
}

#[test]
fn the_python_page_runs() {
    let Some(python) = python("the_python_page_runs", "mcap_protobuf, mcap, numpy, pandas") else { return };
    let page = include_str!("../../../../docs/viewers.md");
    let code: Vec<&str> = page.split("```python\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(code.len() >= 3, "the page has its code");
    let folder = Folder::new();
    folder.agglo(&["init", "clustering"]).code(0);
    folder.agglo(&["run", "clustering.json", "--set", "duration=0.3"]).code(0);
    folder.write("page.py", code.join("\n"));
    let output = std::process::Command::new(python).arg("page.py").current_dir(folder.path("")).output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{out}{err}");
    assert!(out.contains("largest cluster"), "{out}");
}

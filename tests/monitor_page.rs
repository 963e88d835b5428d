//! The page of `monitor --web` over HTTP and WebSocket, with the simulated device: what it shows, how soon, and to whom.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::io::Write;
use std::net::{TcpListener, TcpStream};

use quietcut_tests::command::{folder, quietcut};
use quietcut_tests::monitor_page::{Machine, Page};
use tungstenite::Message;

#[test]
fn the_page_is_whole_and_may_load_nothing() {
    let folder = folder();
    let page = Page::open(folder.path(), "simulated", &["--web"]);
    let answer = page.ask(&["GET / HTTP/1.1", &format!("Host: {}", page.host())]);
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    let head = head.to_ascii_lowercase();
    for needed in [
        "200 ok",
        "content-security-policy: default-src 'none';",
        "cache-control: no-store",
        "nosniff",
        "referrer-policy: no-referrer",
    ] {
        assert!(head.contains(needed), "{needed} is missing in\n{head}");
    }
    assert!(body.trim_end().ends_with("</html>") && !body.contains("{style}"));
    let addresses: Vec<_> = body
        .match_indices("http")
        .map(|(at, _)| &body[at..at + 26])
        .collect();
    assert_eq!(addresses, ["http://www.w3.org/2000/svg"]);
    assert!(!body.contains("src=") && !body.contains(" style=") && !body.contains("innerHTML"));
    for (line, status, word) in [
        ("GET /other HTTP/1.1", "404", "no such page"),
        ("POST / HTTP/1.1", "405", "only be read"),
        ("GET /live HTTP/1.1", "400", ""),
    ] {
        let answer = page.ask(&[line, &format!("Host: {}", page.host())]);
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status}")) && answer.contains(word),
            "{answer}"
        );
    }
}

/// The time of a report is that of its last sample on the clock of the device, which began at a known time.
#[test]
fn a_verdict_arrives_within_a_tenth_of_a_second() {
    let folder = folder();
    let machine = Machine::start();
    let page = Page::open(folder.path(), machine.path(), &["--web"]);
    let mut socket = page.socket();
    machine.chatter();
    let mut delays = Vec::new();
    let mut last = String::new();
    while last != "period-doubling" {
        let head = socket.head(|head| head["verdict"].is_string() && head["verdict"] != last.as_str());
        let delay = machine.began.elapsed().as_secs_f64() - head["t_s"].as_f64().unwrap();
        last = head["verdict"].as_str().unwrap().into();
        delays.push((last.clone(), delay));
    }
    println!("s from the last sample to the socket, by verdict: {delays:.4?}");
    let head = socket.head(|head| head["word"] == "CHATTER");
    assert!(
        head["chatter_hz"]
            .as_f64()
            .is_some_and(|hz| (hz - 17.4).abs() < 1.0),
        "{head}"
    );
    assert!(head["advice"].as_str().unwrap().contains("rev/min"), "{head}");
    // A busy machine delays a process: the shortest of the delays is that of the command.
    let shortest = delays
        .iter()
        .map(|(_, delay)| *delay)
        .fold(f64::INFINITY, f64::min);
    assert!(shortest <= 0.1, "{delays:?}");
}

#[test]
fn each_topic_is_sent_and_a_pulled_cable_is_said() {
    let folder = folder();
    let machine = Machine::start();
    let page = Page::open(folder.path(), machine.path(), &["--web"]);
    let mut socket = page.socket();
    machine.chatter();
    let mut missing = BTreeSet::from(["head", "strip", "history", "spectrum", "map", "lobes"]);
    while !missing.is_empty() {
        let Message::Text(text) = socket.0.read().unwrap() else {
            continue;
        };
        let frame: serde_json::Value = serde_json::from_str(&text).unwrap();
        let is_full = |name: &str| frame[name].as_array().is_some_and(|values| !values.is_empty());
        let has_content = match frame["topic"].as_str().unwrap() {
            "spectrum" => is_full("decibel_tenths"),
            "map" => is_full("points"),
            "history" => is_full("lines"),
            "strip" => frame["letters"] != "",
            _ => true,
        };
        if has_content {
            missing.remove(frame["topic"].as_str().unwrap());
        }
    }
    let path = machine.path().to_owned();
    drop(machine);
    let head = socket.head(|head| head["connection"] == "gone");
    assert_eq!(
        head["connection_text"],
        format!("CABLE PULLED, WAITING FOR {path}")
    );
    assert_eq!(
        (&head["word"], &head["rpm"]),
        (&"GONE".into(), &serde_json::Value::Null)
    );
}

#[test]
fn garbage_is_refused_and_disturbs_nobody() {
    let folder = folder();
    let page = Page::open(folder.path(), "simulated", &["--web"]);
    let mut watching = page.socket();
    watching.next("head");
    for garbage in [
        &b"\x00\xff\x16\x03\x01 no request at all\r\n\r\n"[..],
        &[b'x'; 100_000][..],
        b"GET /\r\n\r\n",
        b"\r\n",
    ] {
        let mut stream = TcpStream::connect(page.host()).unwrap();
        // The server may close the connection before it has read everything.
        let _ = stream.write_all(garbage);
    }
    let mut talking = page.socket();
    talking.0.send(Message::text("{\"stop\":true}")).unwrap();
    let (code, reason) = talking.closed();
    assert_eq!(
        (code, reason.as_str()),
        (1008, "quietcut monitor takes no messages")
    );
    let mut shouting = page.socket();
    let _ = shouting.0.send(Message::binary(vec![7; 1 << 20]));
    shouting.closed();
    watching.head(|head| head["verdict"].is_string());
}

#[test]
fn a_hundred_pages_are_served_and_slow_ones_delay_nobody() {
    let folder = folder();
    let machine = Machine::start();
    let page = Page::open(folder.path(), machine.path(), &["--web"]);
    // Connections without a request, and sockets that never read.
    let silent: Vec<_> = (0..40)
        .map(|_| TcpStream::connect(page.host()).unwrap())
        .collect();
    let slow: Vec<_> = (0..28).map(|_| page.socket()).collect();
    let mut watching: Vec<_> = (0..100).map(|_| page.socket()).collect();
    let key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    let one_more = page.ask(&[
        "GET /live HTTP/1.1",
        &format!("Host: {}", page.host()),
        "Connection: Upgrade",
        "Upgrade: websocket",
        "Sec-WebSocket-Version: 13",
        key,
    ]);
    assert!(
        one_more.starts_with("HTTP/1.1 503") && one_more.contains("close one of them"),
        "{one_more}"
    );
    machine.chatter();
    for socket in &mut watching {
        socket.head(|head| head["verdict"] == "period-doubling");
    }
    drop((silent, slow));
    // Ctrl-C closes each socket with a reason, and the summary has no lost message of the device.
    page.command.interrupt();
    let (code, reason) = watching.pop().unwrap().closed();
    assert_eq!((code, reason.as_str()), (1001, "quietcut monitor has ended"));
    let outcome = page.command.finish();
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    let last: serde_json::Value = serde_json::from_str(outcome.stdout.lines().last().unwrap()).unwrap();
    assert!(
        last["summary"]["blocks"]
            .as_u64()
            .is_some_and(|blocks| blocks > 100),
        "{last}"
    );
    assert_eq!(outcome.stderr, "");
}

#[test]
fn pages_of_other_sites_are_refused() {
    let folder = folder();
    let page = Page::open(folder.path(), "simulated", &["--web"]);
    let rebound = page.ask(&["GET / HTTP/1.1", "Host: example.org"]);
    assert!(
        rebound.starts_with("HTTP/1.1 403") && rebound.contains("not one of this monitor"),
        "{rebound}"
    );
    let host = format!("Host: {}", page.host());
    let foreign = page.ask(&["GET /live HTTP/1.1", &host, "Origin: http://example.org"]);
    assert!(
        foreign.starts_with("HTTP/1.1 403") && foreign.contains("another site"),
        "{foreign}"
    );
}

#[test]
fn another_address_needs_the_token() {
    let folder = folder();
    let page = Page::open(folder.path(), "simulated", &["--web", "0.0.0.0"]);
    assert!(
        !page.url.contains("0.0.0.0") && page.query().starts_with("token="),
        "{}",
        page.url
    );
    let host = format!("Host: {}", page.host());
    for path in [
        "/",
        "/?token=",
        "/live",
        "/?token=0123456789abcdef0123456789abcdef",
    ] {
        let answer = page.ask(&[&format!("GET {path} HTTP/1.1"), &host]);
        assert!(
            answer.starts_with("HTTP/1.1 401") && answer.contains("?token="),
            "{path}: {answer}"
        );
    }
    let answer = page.ask(&[&format!("GET /?{} HTTP/1.1", page.query()), &host]);
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    page.socket().next("head");
}

#[test]
fn an_address_that_cannot_be_used_is_refused() {
    let folder = folder();
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = other.local_addr().unwrap().port().to_string();
    quietcut(folder.path(), &["monitor", "simulated", "--web", &port])
        .refused(&[&port, "another program uses this port"]);
    quietcut(
        folder.path(),
        &["monitor", "simulated", "--web", "192.0.2.1:8080"],
    )
    .refused(&["192.0.2.1:8080", "does not have this address"]);
    quietcut(folder.path(), &["monitor", "--web", "simulated"]).refused(&["`simulated` is no address"]);
    // The page is not announced for a device that is not there.
    quietcut(folder.path(), &["monitor", "/dev/no-such-port", "--web"]).refused(&["/dev/no-such-port"]);
}

#[test]
fn the_only_object_of_json_has_the_address() {
    let folder = folder();
    let arguments = ["monitor", "simulated", "--web", "--seconds", "1", "--json"];
    let outcome = quietcut(folder.path(), &arguments);
    let answer = outcome.json();
    let url = answer["url"].as_str().unwrap();
    assert!(url.starts_with("http://127.0.0.1:"), "{answer}");
    assert!(outcome.stderr.contains(url), "{outcome:?}");
    assert!(answer["summary"]["blocks"].is_u64(), "{answer}");
    let lines = quietcut(
        folder.path(),
        &["monitor", "simulated", "--web", "--seconds", "0.5"],
    );
    assert!(lines.stdout.starts_with("page: http://127.0.0.1:"), "{lines:?}");
}

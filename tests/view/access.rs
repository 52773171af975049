//! Who is let in: requests without the token, under another name, from another origin, too large, or broken.

use super::http::{Socket, connect, get, raw};
use abbe::view::Server;
use abbe::view::live::Published;
use std::io::{Read, Write};
use std::net::Shutdown;
use std::sync::Arc;

fn server() -> Server {
    Server::start("127.0.0.1", 0, Arc::new(Published::default()), None).expect("a server")
}

/// The cookie that the token is exchanged for.
pub fn cookie(server: &Server) -> String {
    let answer = get(server.address, &format!("/?token={}", server.token), &[]);
    let set = answer.header("Set-Cookie").expect("a cookie");
    set.split(';').next().expect("a pair").to_string()
}

#[test]
fn a_token_is_exchanged_for_a_cookie_that_scripts_and_other_sites_do_not_get() {
    let server = server();
    let answer = get(server.address, &format!("/?token={}", server.token), &[]);
    assert_eq!((answer.status, answer.header("Location")), (303, Some("/")), "{}", answer.head);
    let set = answer.header("Set-Cookie").expect("a cookie");
    assert!(set.contains("HttpOnly") && set.contains("SameSite=Strict"), "{set}");
    assert!(server.token.len() >= 32, "a token that cannot be guessed");
    let page = get(server.address, "/", &[("Cookie", &cookie(&server))]);
    assert!(page.status == 200 && page.text().contains("<title>Abbe view</title>"), "{}", page.head);
}

#[test]
fn nothing_is_answered_without_the_token() {
    let server = server();
    let own = cookie(&server);
    let name = own.split('=').next().expect("a name");
    for path in
        ["/", "/page/main.js", "/data/glasses.json", "/data/choices.json", "/picture.png", "/picture.exr", "/socket", "/none"]
    {
        assert_eq!(get(server.address, path, &[]).status, 403, "{path}");
        assert_eq!(get(server.address, path, &[("Cookie", &format!("{name}=0123"))]).status, 403, "{path}, of another session");
    }
    assert_eq!(get(server.address, "/?token=0123", &[]).status, 403);
    assert_eq!(
        get(server.address, &format!("/page/main.js?token={}", server.token), &[]).status,
        403,
        "the token opens the page alone"
    );
    assert_eq!(get(server.address, "/page/main.js", &[("Cookie", &own)]).status, 200);
    assert_eq!(Socket::open(server.address, &[]).err(), Some(403));
}

#[test]
fn names_that_lead_here_by_a_stranger_are_refused() {
    let server = server();
    let own = cookie(&server);
    let with = |host: &str| get(server.address, "/", &[("Host", host), ("Cookie", &own)]).status;
    // The port is that of a tunnel.
    for host in ["localhost:4000", "127.0.0.1", "[::1]:9", "LOCALHOST"] {
        assert_eq!(with(host), 200, "{host}");
    }
    for host in ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "localhost.evil.example:1"] {
        assert_eq!(with(host), 403, "{host}");
    }
}

#[test]
fn pages_of_other_origins_are_refused() {
    let server = server();
    let (own, here) = (cookie(&server), format!("http://{}", server.address));
    let with = |origin: &str| Socket::open(server.address, &[("Cookie", &own), ("Origin", origin)]).err();
    assert_eq!(with(&here), None);
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1", "http://localhost"] {
        assert_eq!(with(origin), Some(403), "{origin}");
    }
    let site = |site: &str| get(server.address, "/picture.png", &[("Cookie", &own), ("Sec-Fetch-Site", site)]).status;
    assert_eq!((site("cross-site"), site("same-site")), (403, 403));
    assert_eq!(site("same-origin"), 404, "there is no picture yet");
}

#[test]
fn every_answer_forbids_what_comes_from_elsewhere() {
    let server = server();
    for answer in [get(server.address, "/", &[]), get(server.address, "/", &[("Cookie", &cookie(&server))])] {
        let policy = answer.header("Content-Security-Policy").expect("a policy");
        assert!(policy.starts_with("default-src 'self'") && policy.contains("frame-ancestors 'none'"), "{policy}");
        assert_eq!(answer.header("Referrer-Policy"), Some("no-referrer"));
        assert_eq!(answer.header("X-Content-Type-Options"), Some("nosniff"));
        assert_eq!(answer.header("Cache-Control"), Some("no-store"));
    }
}

#[test]
fn what_is_too_large_or_broken_ends_that_socket_and_no_other() {
    let server = server();
    let own = cookie(&server);
    let open = || Socket::open(server.address, &[("Cookie", &own)]).expect("a socket");
    let mut bystander = open();
    assert!(bystander.message("document").is_some());
    let large = format!(r#"{{"type": "look", "look": {{"pad": "{}"}}}}"#, "x".repeat(70 << 10));
    for text in [large.as_str(), "{", "[1, 2", "\u{0}"] {
        let mut socket = open();
        socket.send(text);
        assert!(std::iter::from_fn(|| socket.receive()).count() < 20, "it is closed");
    }
    // Of the right size and of no meaning, they change nothing.
    for text in [
        "{}",
        "[]",
        "null",
        r#"{"type": "edit", "path": 3}"#,
        r#"{"type": "spectrum", "region": [2, "x", null, 1]}"#,
        r#"{"type": "look", "look": {"stops": 1e300}}"#,
    ] {
        bystander.send(text);
    }
    bystander.send(r#"{"type": "spectrum", "id": 7, "region": [0, 0, 1, 1]}"#);
    let answer = std::iter::from_fn(|| bystander.message("spectrum")).find(|m| m["id"] == 7).expect("an answer");
    assert_eq!(answer["nothing"], true);
    let mut cut = connect(server.address);
    cut.write_all(b"GET / HTTP/1.1\r\nHost").expect("sent");
    cut.shutdown(Shutdown::Write).expect("an end");
    assert_eq!(cut.read_to_end(&mut Vec::new()).unwrap_or(0), 0, "half a request has no answer");
    assert!(matches!(raw(server.address, "BROKEN\r\n\r\n").status, 0 | 400));
    let no_file = get(server.address, "/page/..%2f..%2fCargo.toml", &[("Cookie", &own)]);
    assert_eq!(no_file.status, 404, "only what is built in");
}

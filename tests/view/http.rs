//! Requests as anybody on the machine could send them, byte by byte.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// An answer.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn header(&self, name: &str) -> Option<&str> {
        let line = self.head.lines().find(|line| line.to_lowercase().starts_with(&format!("{}:", name.to_lowercase())))?;
        line.split_once(':').map(|(_, value)| value.trim())
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}

pub fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).expect("a connection");
    stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time limit");
    stream
}

/// Sends `GET path` with these headers; `Host` is the address unless given.
pub fn get(address: SocketAddr, path: &str, headers: &[(&str, &str)]) -> Answer {
    let host = format!("Host: {address}\r\n");
    let given: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    let host = if headers.iter().any(|(name, _)| *name == "Host") { "" } else { &host };
    raw(address, &format!("GET {path} HTTP/1.1\r\n{host}{given}Connection: close\r\n\r\n"))
}

/// Sends JSON and returns what comes back, as WebDriver has it: an object with a `value`.
pub fn json(address: SocketAddr, method: &str, path: &str, body: &serde_json::Value) -> Result<serde_json::Value, String> {
    let body = if method == "GET" || method == "DELETE" { String::new() } else { body.to_string() };
    let length = body.len();
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: {address}\r\nContent-Type: application/json\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    );
    let answer = raw(address, &(head + &body));
    let value: serde_json::Value = serde_json::from_slice(&answer.body).map_err(|e| format!("{path}: {e}"))?;
    if answer.status == 200 { Ok(value["value"].clone()) } else { Err(format!("{path}: {}", value["value"]["message"])) }
}

/// Whether an answer says how long its body is, and has all of it.
fn is_whole(bytes: &[u8]) -> bool {
    let Some(end) = bytes.windows(4).position(|w| w == b"\r\n\r\n") else { return false };
    let head = String::from_utf8_lossy(&bytes[..end]).to_lowercase();
    let length = head.lines().find_map(|line| line.strip_prefix("content-length:")?.trim().parse::<usize>().ok());
    length.is_some_and(|length| bytes.len() >= end + 4 + length)
}

/// Sends bytes as they are and reads the answer.
pub fn raw(address: SocketAddr, request: &str) -> Answer {
    let mut stream = connect(address);
    stream.write_all(request.as_bytes()).expect("sent");
    let mut bytes = Vec::new();
    let mut part = [0; 1 << 16];
    // Some servers keep the connection, and say how long their answer is.
    while !is_whole(&bytes) {
        match stream.read(&mut part) {
            Ok(n) if n > 0 => bytes.extend_from_slice(&part[..n]),
            _ => break,
        }
    }
    let end = bytes.windows(4).position(|w| w == b"\r\n\r\n").map_or(bytes.len(), |at| at + 4);
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or(0);
    Answer { status, head, body: bytes[end..].to_vec() }
}

/// A WebSocket, by RFC 6455.
pub struct Socket(TcpStream);

impl Socket {
    /// Opens it, or says with which status it was refused.
    pub fn open(address: SocketAddr, headers: &[(&str, &str)]) -> Result<Self, u16> {
        let mut stream = connect(address);
        let given: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        let request = format!(
            "GET /socket HTTP/1.1\r\nHost: {address}\r\n{given}Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).expect("sent");
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            if stream.read(&mut byte).unwrap_or(0) == 0 {
                break;
            }
            head.push(byte[0]);
        }
        match String::from_utf8_lossy(&head).split(' ').nth(1).and_then(|s| s.parse().ok()) {
            Some(101) => Ok(Socket(stream)),
            status => Err(status.unwrap_or(0)),
        }
    }

    /// Sends a text in one frame, under a mask of zeros.
    pub fn send(&mut self, text: &str) {
        let length = text.len();
        let mut frame = vec![0x81];
        match length {
            0..126 => frame.push(0x80 | length as u8),
            126..65536 => frame.extend([&[0xfe][..], &(length as u16).to_be_bytes()].concat()),
            _ => frame.extend([&[0xff][..], &(length as u64).to_be_bytes()].concat()),
        }
        frame.extend([0; 4]);
        frame.extend(text.as_bytes());
        // What is too large may be refused before it is all sent.
        let _ = self.0.write_all(&frame);
    }

    /// The next message: text or not, and its bytes; `None` when the socket is closed.
    pub fn receive(&mut self) -> Option<(bool, Vec<u8>)> {
        loop {
            let mut head = [0; 2];
            self.0.read_exact(&mut head).ok()?;
            let length = match head[1] & 0x7f {
                126 => {
                    let mut more = [0; 2];
                    self.0.read_exact(&mut more).ok()?;
                    u64::from(u16::from_be_bytes(more))
                }
                127 => {
                    let mut more = [0; 8];
                    self.0.read_exact(&mut more).ok()?;
                    u64::from_be_bytes(more)
                }
                short => u64::from(short),
            };
            let mut body = vec![0; length as usize];
            self.0.read_exact(&mut body).ok()?;
            match head[0] & 0xf {
                1 => return Some((true, body)),
                2 => return Some((false, body)),
                8 => return None,
                _ => {}
            }
        }
    }

    /// The next frame whose head is as wanted, and its PNG or JPEG; all frames until then are acknowledged.
    pub fn frame(&mut self, is_wanted: impl Fn(&serde_json::Value) -> bool) -> Option<(serde_json::Value, Vec<u8>)> {
        loop {
            if let (false, frame) = self.receive()? {
                let (head, length) =
                    (frame_head(&frame), u32::from_le_bytes(frame[..4].try_into().expect("four bytes")) as usize);
                self.send(&format!(r#"{{"type": "ack", "source": {}}}"#, head["source"]));
                if is_wanted(&head) {
                    return Some((head, frame[4 + length..].to_vec()));
                }
            }
        }
    }

    /// The next text of this type, as JSON; frames that come before are acknowledged.
    pub fn message(&mut self, kind: &str) -> Option<serde_json::Value> {
        loop {
            match self.receive()? {
                (true, text) => {
                    let value: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
                    if value["type"] == kind {
                        return Some(value);
                    }
                }
                (false, frame) => {
                    let head = frame_head(&frame);
                    self.send(&format!(r#"{{"type": "ack", "source": {}}}"#, head["source"]));
                }
            }
        }
    }
}

/// The head of a frame.
pub fn frame_head(frame: &[u8]) -> serde_json::Value {
    let length = u32::from_le_bytes(frame[..4].try_into().expect("four bytes")) as usize;
    serde_json::from_slice(&frame[4..4 + length]).expect("JSON")
}

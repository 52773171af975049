//! Who may come in: as with Jupyter, whoever has the token that the terminal prints, from a page of this server and no other.

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, Response, StatusCode, header};
use axum::middleware::Next;
use std::net::IpAddr;
use std::sync::Arc;

/// What a request is held against.
#[derive(Debug, Clone)]
pub struct Access {
    token: Arc<str>,
    /// Names that this server goes by, without ports: tunnels have ports of their own.
    hosts: Arc<[String]>,
    /// It listens at more than the loopback address: addresses in numbers lead here, too, which no stranger's name service can give away.
    is_open: bool,
    cookie: Arc<str>,
}

/// Of every answer. Nothing is loaded from elsewhere, shown within other pages, told to others or kept.
fn answer_headers() -> [(header::HeaderName, &'static str); 5] {
    [
        (header::CONTENT_SECURITY_POLICY, "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_FRAME_OPTIONS, "DENY"),
    ]
}

impl Access {
    /// With a new token, for a server at this address.
    ///
    /// # Errors
    /// Says that the system has no random numbers.
    pub fn new(host: &str, port: u16) -> Result<Self, String> {
        let mut bytes = [0u8; 24];
        getrandom::fill(&mut bytes).map_err(|e| format!("no random numbers for a token: {e}"))?;
        let token: String = bytes.iter().map(|b| format!("{b:02x}")).collect();
        let hosts = ["127.0.0.1", "localhost", "[::1]", host].map(str::to_string);
        // Cookies know no ports: two servers on one machine must not take each other's.
        Ok(Access {
            token: token.into(),
            hosts: hosts.into(),
            is_open: !is_loopback(host),
            cookie: format!("abbe-view-{port}").into(),
        })
    }

    /// What the URL has to have.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Whether the request is meant for this server: no other name that leads here (DNS rebinding).
    fn is_addressed(&self, headers: &HeaderMap) -> bool {
        let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
        let name = without_port(host);
        let is_number = || name.trim_matches(['[', ']']).parse::<IpAddr>().is_ok();
        self.hosts.iter().any(|known| known.eq_ignore_ascii_case(name)) || self.is_open && is_number()
    }

    /// Whether it comes from a page of this server, or from no page at all.
    fn is_from_here(&self, headers: &HeaderMap) -> bool {
        let text = |name| headers.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
        let same_site =
            text(header::HeaderName::from_static("sec-fetch-site")).is_none_or(|site| matches!(site, "same-origin" | "none"));
        let Some(origin) = headers.get(header::ORIGIN) else { return same_site };
        let origin = origin.to_str().ok().and_then(|origin| origin.split_once("://")).map(|(_, host)| host);
        same_site && origin.is_some() && origin == text(header::HOST)
    }

    fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut pairs = cookies.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
        pairs.any(|(name, value)| name == &*self.cookie && self.is_token(value))
    }

    /// In a time that does not depend on where they differ.
    fn is_token(&self, text: &str) -> bool {
        let (a, b) = (text.as_bytes(), self.token.as_bytes());
        a.len() == b.len() && a.iter().zip(b).fold(0, |all, (a, b)| all | (a ^ b)) == 0
    }
}

/// The name of a host, without its port.
fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if !port.contains(']') => name,
        _ => host,
    }
}

/// Whether only this machine can reach an address.
pub fn is_loopback(host: &str) -> bool {
    host == "localhost" || host.trim_matches(['[', ']']).parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

/// Lets a request through, exchanges a token for a cookie, or turns it away.
pub async fn guard(State(access): State<Access>, request: Request, next: Next) -> Response<Body> {
    let headers = request.headers();
    let mut response = if !access.is_addressed(headers) {
        refusal("This name does not lead here.")
    } else if let Some(token) = token_of(&request).filter(|_| request.method() == Method::GET) {
        if access.is_token(token) {
            welcome(&access)
        } else {
            refusal("This token is of another session. Open the address that the terminal prints.")
        }
    } else if !access.has_cookie(headers) {
        refusal("Open the address that the terminal prints: it has a token.")
    } else if !access.is_from_here(headers) {
        refusal("Requests of other pages are not met.")
    } else {
        next.run(request).await
    };
    for (name, value) in answer_headers() {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

fn token_of(request: &Request) -> Option<&str> {
    let is_page = request.uri().path() == "/";
    request.uri().query().filter(|_| is_page)?.split('&').find_map(|pair| pair.strip_prefix("token="))
}

/// To the page, by an address without the token, which would stay in the browser's history.
fn welcome(access: &Access) -> Response<Body> {
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::SEE_OTHER;
    response.headers_mut().insert(header::LOCATION, HeaderValue::from_static("/"));
    let cookie = format!("{}={}; Path=/; HttpOnly; SameSite=Strict", access.cookie, access.token);
    if let Ok(cookie) = HeaderValue::from_str(&cookie) {
        response.headers_mut().insert(header::SET_COOKIE, cookie);
    }
    response
}

fn refusal(text: &'static str) -> Response<Body> {
    let mut response = Response::new(Body::from(text));
    *response.status_mut() = StatusCode::FORBIDDEN;
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static("text/plain; charset=utf-8"));
    response
}

//! A server on loopback for one log: an unguessable path, checked `Host` and `Origin`, ranges, no listing, nothing else.

use std::fs::File;
use std::io::{self, BufReader};
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use agglo_record::layout::FULL;
use agglo_record::run::LAYOUT;
use agglo_replay::Log;
use axum::Router;
use axum::extract::{Request, State};
use axum::http::header::{
    ACCEPT_RANGES, CACHE_CONTROL, CONTENT_LENGTH, CONTENT_RANGE, CONTENT_TYPE, ETAG, HOST, HeaderName, HeaderValue,
    LAST_MODIFIED, ORIGIN, RANGE, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{Method, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tower_http::cors::{AllowOrigin, CorsLayer};
use tower_http::services::ServeFile;

use super::site::Site;
use crate::args::ViewArgs;
use crate::failure::{Failure, Message};
use crate::interrupt::Interrupt;
use crate::output;
use crate::target::Target;
use crate::terminal::Terminal;

/// How often Ctrl-C is looked for.
const PATIENCE: Duration = Duration::from_millis(100);

/// Serves a log until Ctrl-C.
///
/// # Errors
/// A port that is taken, a system that refuses; a standard output that cannot be written to.
pub fn serve(log: &mut Log<BufReader<File>>, args: &ViewArgs, terminal: &Terminal) -> Result<(), Failure> {
    let interrupt = Interrupt::install()?;
    let layout = log.attachment(LAYOUT).ok().flatten().unwrap_or_else(|| FULL.into());
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, args.port)).map_err(|error| busy(args.port, &error))?;
    let address = listener.local_addr().map_err(|error| refused(&error))?;
    let site = Site::new(&args.log, layout, token()?, &args.allow_origin, address);
    output::write_all(&Target::Standard, false, site.text().as_bytes())?;
    if args.open
        && let Err(error) = open::that_detached(site.foxglove())
    {
        terminal.warning(&Message::new(format!("no browser could be opened: {error}")).hint("follow a link above"));
    }
    run(listener, site, &interrupt).map_err(|error| refused(&error))
}

fn busy(port: u16, error: &io::Error) -> Failure {
    let message = Message::new(format!("cannot serve on 127.0.0.1:{port}: {error}"));
    Failure::Input(message.hint("--port 0 takes a free one"))
}

fn refused(error: &io::Error) -> Failure {
    Failure::Failed(Message::new(format!("cannot serve the log: {error}")))
}

/// 128 random bits in hexadecimal digits.
fn token() -> Result<String, Failure> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| Failure::Failed(Message::new(format!("the system gives no random numbers: {error}"))))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

fn run(listener: TcpListener, site: Site, interrupt: &Interrupt) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    // Answers come from the disk: one thread is enough, and blocking reads have threads of their own.
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let guard = runtime.enter();
    let listener = tokio::net::TcpListener::from_std(listener)?;
    drop(guard);
    let server = runtime.spawn(async move { axum::serve(listener, router(Arc::new(site))).await });
    runtime.block_on(async {
        while !interrupt.asked() && !server.is_finished() {
            tokio::time::sleep(PATIENCE).await;
        }
        if server.is_finished() { server.await? } else { Ok(()) }
    })
    // Whoever is still reading is cut off here: a viewer may hold its connection for ever.
}

fn router(site: Arc<Site>) -> Router {
    let (log, layout) = (format!("/{}/{}", site.token, site.name), format!("/{}/layout.json", site.token));
    let origins = site.origins.iter().filter_map(|origin| HeaderValue::from_str(origin).ok());
    let cors = CorsLayer::new()
        .allow_origin(AllowOrigin::list(origins))
        .allow_methods([Method::GET, Method::HEAD])
        .allow_headers([RANGE, CACHE_CONTROL])
        .expose_headers([ACCEPT_RANGES, CONTENT_LENGTH, CONTENT_RANGE, ETAG, LAST_MODIFIED])
        .allow_private_network(true);
    Router::new()
        .route_service(&log, ServeFile::new(&site.log))
        .route(&layout, get(attached))
        .fallback(|| async { StatusCode::NOT_FOUND })
        .layer(cors)
        .layer(from_fn_with_state(Arc::clone(&site), guard))
        .with_state(site)
}

async fn attached(State(site): State<Arc<Site>>) -> impl IntoResponse {
    ([(CONTENT_TYPE, "application/json")], site.layout.clone())
}

/// Turns away whoever speaks to another host or from a page that is not named, and forbids to keep what is sent.
async fn guard(State(site): State<Arc<Site>>, request: Request, next: Next) -> Response {
    let mut response = match turned_away(&site, &request) {
        Some(status) => status.into_response(),
        None => next.run(request).await,
    };
    for (name, value) in [
        (CACHE_CONTROL, "no-store"),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
        (HeaderName::from_static("cross-origin-resource-policy"), "cross-origin"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

fn turned_away(site: &Site, request: &Request) -> Option<StatusCode> {
    let header = |name| request.headers().get(name).map(|value| value.to_str().unwrap_or_default());
    let named = header(HOST).is_some_and(|host| site.hosts().iter().any(|known| known == host));
    let welcome = header(ORIGIN).is_none_or(|origin| site.origins.iter().any(|known| known == origin));
    if !named {
        Some(StatusCode::MISDIRECTED_REQUEST)
    } else if !welcome {
        Some(StatusCode::FORBIDDEN)
    } else {
        None
    }
}

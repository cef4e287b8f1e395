//! `agglo run --live`: what is recorded goes to viewers as well, over Foxglove's websocket protocol, while the run solves.
//!
//! The solver's thread hands a message to a queue per viewer that never waits: a viewer that does not keep up loses
//! messages, the run loses nothing. Viewers can send nothing.

use std::net::{SocketAddr, ToSocketAddrs};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use agglo_core::scene::Scene;
use agglo_record::channels::{CHANNELS, Effects, Topic, present};
use agglo_record::cloud::CloudWriter;
use agglo_record::encoder::Encoded;
use agglo_record::{RecordError, Tap};
use foxglove::websocket::{Capability, ChannelView, Client, ServerListener};
use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServer, WebSocketServerHandle};
use tokio::runtime::Runtime;

use crate::failure::{Failure, Message};
use crate::terminal::Terminal;

/// Where viewers look first.
const PORT: u16 = 8765;

/// Bytes that may wait for a viewer, about, and the messages that this may be.
const BACKLOG_BYTES: usize = 64 << 20;
const BACKLOG: std::ops::RangeInclusive<usize> = 32..=4096;

/// How often the time is broadcast at most: between messages it only moves a cursor.
const TICK: Duration = Duration::from_millis(10);

/// How long the last messages have to leave when the run is over.
const FAREWELL: Duration = Duration::from_millis(500);

/// A server of a run.
pub struct Live {
    server: Arc<WebSocketServerHandle>,
    board: Arc<Board>,
    /// What connects channels and server: dropped, no channel would be announced.
    _context: Arc<Context>,
    /// Runs the server until it is dropped.
    runtime: Runtime,
}

/// The channels, and what stands on them: viewers that come late are told.
struct Board {
    channels: [Option<Arc<RawChannel>>; CHANNELS.len()],
    last: Mutex<[Option<Posted>; CHANNELS.len()]>,
}

/// The last message of a channel.
#[derive(Default)]
struct Posted {
    log_time: u64,
    data: Vec<u8>,
}

impl Live {
    /// Starts a server for a run of a scene.
    ///
    /// # Errors
    /// An address that makes no sense or cannot be had; a system that gives no thread.
    pub fn start(address: &str, scene: &Scene, terminal: &Terminal) -> Result<Self, Failure> {
        let effects = Effects::of(scene).map_err(|error: RecordError| failed(&error))?;
        let (host, port) = parse(address)?;
        let bound = (host.as_str(), port).to_socket_addrs().map_err(|error| refused(address, &error))?;
        let bound: Vec<SocketAddr> = bound.collect();
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("live")
            .enable_all()
            .build()
            .map_err(|error| failed(&error))?;
        let context = Context::new();
        let board = Arc::new(Board::new(&context, &effects).map_err(|error| failed(&error))?);
        let message = CloudWriter::new(&effects).stride() * effects.particles;
        let server = WebSocketServer::new()
            .name(format!("agglo: {}", scene.name.as_deref().unwrap_or("a run")))
            .bind(host.as_str(), port)
            .context(&context)
            // Of what viewers may be allowed to do, nothing.
            .capabilities([Capability::Time])
            .message_backlog_size((BACKLOG_BYTES / message.max(1)).clamp(*BACKLOG.start(), *BACKLOG.end()))
            .listener(Arc::clone(&board) as Arc<dyn ServerListener>);
        let server = runtime.block_on(server.start()).map_err(|error| refused(address, &error))?;
        announce(&host, server.port(), &bound, terminal);
        Ok(Self { server: Arc::new(server), board, _context: context, runtime })
    }

    /// What the recorder tells every message.
    pub fn tap(&self) -> Tap {
        let (server, board) = (Arc::clone(&self.server), Arc::clone(&self.board));
        let mut told: Option<Instant> = None;
        Box::new(move |message: Encoded<'_>| {
            let state = message.topic == Topic::Particles;
            if state && told.is_none_or(|told| told.elapsed() >= TICK) {
                told = Some(Instant::now());
                server.broadcast_time(message.log_time);
            }
            board.post(message);
        })
    }

    /// Ends the server when what is under way has left.
    pub fn finish(self) {
        let Self { server, board, _context, runtime } = self;
        if server.client_count() > 0 {
            if let Some(Some(state)) = board.last().get(Topic::Particles as usize) {
                server.broadcast_time(state.log_time);
            }
            std::thread::sleep(FAREWELL);
        }
        if let Some(server) = Arc::into_inner(server) {
            server.stop().detach_all();
        }
        runtime.shutdown_timeout(FAREWELL);
    }
}

impl Board {
    fn new(context: &Arc<Context>, effects: &Effects) -> Result<Self, foxglove::FoxgloveError> {
        let mut channels = [const { None }; CHANNELS.len()];
        for channel in present(effects) {
            let schema = Schema::new(channel.schema, "protobuf", channel.descriptor);
            let builder = ChannelBuilder::new(channel.name).message_encoding("protobuf").schema(schema);
            channels[channel.topic as usize] = Some(builder.context(context).build_raw()?);
        }
        Ok(Self { channels, last: Mutex::default() })
    }

    fn last(&self) -> std::sync::MutexGuard<'_, [Option<Posted>; CHANNELS.len()]> {
        // What is posted is whole even if another thread failed at it.
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends a message to all who want it, and keeps it for those who come later.
    fn post(&self, message: Encoded<'_>) {
        let Encoded { topic, log_time, data } = message;
        let Some(channel) = &self.channels[topic as usize] else { return };
        // Held over both, so that nobody is told of an older state after a newer one.
        let mut last = self.last();
        let posted = last[topic as usize].get_or_insert_default();
        posted.log_time = log_time;
        posted.data.clear();
        posted.data.extend_from_slice(data);
        channel.log_with_meta(data, PartialMetadata::with_log_time(log_time));
    }
}

impl ServerListener for Board {
    fn on_subscribe(&self, client: Client, view: ChannelView) {
        let Some(sink) = client.sink_id() else { return };
        let channels = self.channels.iter().enumerate();
        let found = channels.filter_map(|(k, channel)| Some((k, channel.as_ref()?))).find(|(_, c)| c.id() == view.id());
        let Some((topic, channel)) = found else { return };
        if let Some(Posted { log_time, data }) = &self.last()[topic] {
            channel.log_with_meta_to_sink(data, PartialMetadata::with_log_time(*log_time), Some(sink));
        }
    }
}

/// Host and port of an address: `HOST:PORT`, `HOST` or `PORT`.
fn parse(address: &str) -> Result<(String, u16), Failure> {
    let wrong = || {
        let text = format!("--live={address}: that is no address");
        Failure::Input(Message::new(text).hint("it is HOST:PORT, HOST or PORT, such as 127.0.0.1:8765"))
    };
    let host = |text: &str| text.trim_start_matches('[').trim_end_matches(']').to_owned();
    if address.trim().is_empty() || address.contains('[') != address.contains(']') {
        return Err(wrong());
    }
    if let Ok(port) = address.parse() {
        return Ok(("127.0.0.1".to_owned(), port));
    }
    if address.parse::<std::net::IpAddr>().is_ok() || !address.contains(':') || address.ends_with(']') {
        return Ok((host(address), PORT));
    }
    match address.rsplit_once(':').map(|(name, port)| (host(name), port.parse())) {
        Some((name, Ok(port))) => Ok((if name.is_empty() { "127.0.0.1".to_owned() } else { name }, port)),
        _ => Err(wrong()),
    }
}

fn announce(host: &str, port: u16, bound: &[SocketAddr], terminal: &Terminal) {
    let host = if host.contains(':') { format!("[{host}]") } else { host.to_owned() };
    let address = format!("ws://{host}:{port}");
    terminal.note(format!("live at {address}: open a Foxglove WebSocket connection to it in Foxglove or Lichtblick"));
    if !bound.iter().all(|address| address.ip().is_loopback()) {
        let text = format!("whoever can reach {address} can watch this run");
        terminal.warning(&Message::new(text).hint("`--live` alone serves this machine only"));
    }
}

fn refused(address: &str, error: &dyn std::fmt::Display) -> Failure {
    let message = Message::new(format!("cannot serve viewers on {address}: {error}"));
    Failure::Input(message.hint("--live=127.0.0.1:0 takes a free port"))
}

fn failed(error: &dyn std::fmt::Display) -> Failure {
    Failure::Failed(Message::new(format!("cannot serve viewers: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_hosts_and_ports() {
        for (text, host, port) in [
            ("127.0.0.1:8765", "127.0.0.1", 8765),
            ("9000", "127.0.0.1", 9000),
            (":9000", "127.0.0.1", 9000),
            ("0.0.0.0", "0.0.0.0", PORT),
            ("localhost", "localhost", PORT),
            ("[::1]:9000", "::1", 9000),
            ("::1", "::1", PORT),
            ("[::1]", "::1", PORT),
        ] {
            let parsed = parse(text).unwrap_or_else(|_| panic!("{text}"));
            assert_eq!(parsed, (host.to_owned(), port), "{text}");
        }
        for wrong in ["localhost:http", "127.0.0.1:99999", "", " ", "[::1"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}

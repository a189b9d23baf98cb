//! Plans and forecasts: the exchange algorithm, predictions against results of fits, and the
//! commands.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

mod common;

#[path = "design/bench.rs"]
mod bench;
#[path = "design/command.rs"]
mod command;
#[path = "design/confirmed.rs"]
mod confirmed;
#[path = "design/detection.rs"]
mod detection;
#[path = "design/exchange.rs"]
mod exchange;
#[path = "design/forecast.rs"]
mod forecast;
#[path = "design/next.rs"]
mod next;
#[path = "design/separate.rs"]
mod separate;

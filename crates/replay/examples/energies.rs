//! Opens a log and prints its energies as a table: `cargo run --example energies -- clustering.mcap`.

use agglo_record::channels::Topic;
use agglo_replay::{Log, LogError, Message};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: energies LOG")?;
    let mut log = Log::open(&path)?;
    println!("# {} particles of {:?}", log.run().particles, log.run().scene_name);
    println!("t[s] kinetic[J] near_field[J] binding[J] thermal[J] lost_in_impacts[J] residual[J]");
    for entry in log.messages().only(&[Topic::Energy]) {
        match entry {
            Ok(entry) => {
                if let Message::Energy(ledger, _) = entry.message {
                    let lost = ledger.totals.impact_loss + ledger.totals.friction_loss;
                    println!(
                        "{} {} {} {} {} {lost} {}",
                        entry.t, ledger.kinetic, ledger.near_field, ledger.binding, ledger.thermal, ledger.residual
                    );
                }
            }
            // What is whole of a damaged log is still worth a table.
            Err(LogError::Damaged(damage)) => eprintln!("{damage}"),
            Err(other) => return Err(other.into()),
        }
    }
    Ok(())
}

//! Records and metrics, whatever they are given.

mod metrics;
mod record_readers;
mod records_on_disk;

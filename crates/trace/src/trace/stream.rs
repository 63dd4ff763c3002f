//! The layout of an Arrow IPC stream: the same messages as in a file, one after the other,
//! without a footer that says where they lie.

use arrow_ipc::root_as_message;

use crate::error::Result;
use crate::trace::layout::{
    Block, CONTINUATION, Layout, check_version, not_a_trace, read_message, read_schema,
};
use crate::trace::seal::damaged;

/// Reads the layout of the stream whose bytes are `file`: the schema, then what each
/// batch's message says of its length. The batches themselves are checked when they are
/// read, like those of a file.
pub(crate) fn parse(file: &[u8], place: &str) -> Result<Layout> {
    let bad = || damaged(place, "the schema at its head cannot be read");
    let (message, head_end) = read_message(file, 0, file.len()).ok_or_else(bad)?;
    let message = root_as_message(message).map_err(|_| bad())?;
    check_version(message.version(), place)?;
    let schema = message.header_as_schema().ok_or_else(bad)?;
    let (metadata, columns) = read_schema(schema, place)?;

    let mut blocks: Vec<Block> = Vec::new();
    let mut end = head_end;
    loop {
        let i = blocks.len();
        // Without its end marker a stream that was cut between batches would pass.
        let cut = || damaged(place, format_args!("it ends in batch {i} (truncated)"));
        if file.get(end..end + 8) == Some(&[CONTINUATION, [0; 4]].concat()) {
            break;
        }
        let (message, message_end) = read_message(file, end, file.len()).ok_or_else(cut)?;
        let message = root_as_message(message)
            .map_err(|_| damaged(place, format_args!("batch {i}'s message cannot be read")))?;
        if message.header_as_dictionary_batch().is_some() {
            return Err(not_a_trace(place, "it has dictionary-encoded columns"));
        }
        let body_bytes = usize::try_from(message.bodyLength()).map_err(|_| cut())?;
        let block = Block { offset: end as u64, message_bytes: message_end - end, body_bytes };
        end =
            message_end.checked_add(body_bytes).filter(|end| *end <= file.len()).ok_or_else(cut)?;
        blocks.push(block);
    }
    if end + 8 != file.len() {
        return Err(damaged(place, "there are stray bytes after its last batch"));
    }
    Ok(Layout { metadata, columns, head_end: head_end as u64, blocks, footer_metadata: None })
}

// Reads an MCAP file with the libraries that Foxglove itself uses, by its index and as a stream.
"use strict";
const fs = require("fs");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { decompress } = require("fzstd");

const text = (bytes) => new TextDecoder().decode(bytes);
const data = new Uint8Array(fs.readFileSync(process.argv[2]));
const decompressHandlers = {
  zstd: (packed, size) => decompress(new Uint8Array(packed), new Uint8Array(Number(size))),
};
const readable = {
  size: async () => BigInt(data.length),
  read: async (at, size) => data.slice(Number(at), Number(at + size)),
};

async function main() {
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const decoders = new Map();
  const topics = {};
  let last = 0n;
  for await (const message of reader.readMessages()) {
    if (message.logTime < last) throw new Error("messages are out of order");
    last = message.logTime;
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    if (channel.messageEncoding === "cdr" && !decoders.has(channel.id)) {
      decoders.set(channel.id, new MessageReader(parse(text(schema.data), { ros2: true })));
    }
    const decoder = decoders.get(channel.id);
    const value = decoder ? decoder.readMessage(message.data) : JSON.parse(text(message.data));
    const topic = (topics[channel.topic] ??= { times: [], values: [] });
    topic.times.push(String(message.logTime));
    topic.values.push(value);
  }
  const metadata = {};
  for await (const item of reader.readMetadata()) metadata[item.name] = [...item.metadata];
  const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  stream.append(data);
  let streamed = 0;
  for (let record; (record = stream.nextRecord()); ) streamed += record.type === "Message";
  console.log(JSON.stringify({ topics, metadata, streamed, ended: stream.done() }));
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});

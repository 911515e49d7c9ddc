// Read MCAP files whole by the MCAP project's TypeScript reader; one line of JSON a file.
// Checked on the way: CRCs of chunks, attachments, index and data section, and that every
// message is one that Foxglove shows: decoded by the schema embedded in the file with the same
// library (protobufjs) in the same way, all of its fields known to that schema.
import { McapIndexedReader } from "@mcap/core";
import { loadDecompressHandlers, protobufFromBinaryDescriptor } from "@mcap/support";
import { crc32 } from "@foxglove/crc";
import { createHash } from "node:crypto";
import { open } from "node:fs/promises";

const BLOCK = 1n << 20n;

async function readable(handle) {
  const size = BigInt((await handle.stat()).size);
  return {
    size: async () => size,
    read: async (offset, length) => {
      const buffer = new Uint8Array(Number(length));
      const { bytesRead } = await handle.read(buffer, 0, Number(length), Number(offset));
      if (bytesRead !== Number(length)) throw new Error(`cut short at ${offset}`);
      return buffer;
    },
  };
}

async function dataSectionIsWhole(reader, file) {
  const hash = [];
  for (let at = 0n; at < reader.dataEndOffset; at += BLOCK) {
    const left = reader.dataEndOffset - at;
    hash.push(await file.read(at, left < BLOCK ? left : BLOCK));
  }
  return crc32(Buffer.concat(hash)) === reader.dataSectionCrc;
}

// As Foxglove Studio does (its package mcap-support, parseProtobufSchema), which turns a channel
// away where any field of its messages, however deep, is a list of bytes.
function decoderOf(schema) {
  const root = protobufFromBinaryDescriptor(schema.data);
  root.resolveAll();
  const type = root.lookupType(schema.name);
  refuseListsOfBytes(type, new Set());
  return (data) => {
    const message = type.decode(data);
    type.toObject(message, { defaults: true });
    if (!Buffer.from(type.encode(message).finish()).equals(data)) {
      throw new Error(`${schema.name}: not all of a message is known to its schema`);
    }
  };
}

function refuseListsOfBytes(type, seen) {
  seen.add(type);
  for (const field of type.fieldsArray) {
    if (field.type === "bytes" && field.repeated) {
      throw new Error(`${field.fullName} is a list of bytes, which Foxglove Studio does not read`);
    }
    const inner = field.resolvedType;
    if (inner?.fieldsArray && !seen.has(inner)) refuseListsOfBytes(inner, seen);
  }
}

async function contents(path, decompressHandlers) {
  const handle = await open(path, "r");
  try {
    const file = await readable(handle);
    const reader = await McapIndexedReader.Initialize({ readable: file, decompressHandlers });
    const types = new Map();
    for (const [id, channel] of reader.channelsById) {
      const schema = reader.schemasById.get(channel.schemaId);
      types.set(id, { topic: channel.topic, name: schema.name, decode: decoderOf(schema) });
    }
    const counts = {};
    const digest = createHash("sha256");
    for await (const message of reader.readMessages({ validateCrcs: true })) {
      const { topic, name, decode } = types.get(message.channelId);
      decode(message.data);
      counts[topic] = [name, (counts[topic]?.[1] ?? 0) + 1];
      digest.update(message.data);
    }
    const metadata = {};
    for await (const record of reader.readMetadata()) {
      metadata[record.name] = Object.fromEntries(record.metadata);
    }
    const attachments = {};
    for await (const record of reader.readAttachments({ validateCrcs: true })) {
      attachments[record.name] = createHash("sha256").update(record.data).digest("hex");
    }
    const channels = {};
    for (const channel of reader.channelsById.values()) {
      channels[channel.topic] = Object.fromEntries(channel.metadata);
    }
    const schemas = {};
    for (const schema of reader.schemasById.values()) {
      schemas[schema.name] = createHash("sha256").update(schema.data).digest("hex");
    }
    return {
      messages: Number(reader.statistics.messageCount),
      data_whole: await dataSectionIsWhole(reader, file),
      counts,
      metadata,
      attachments,
      channels,
      schemas,
      messages_sha256: digest.digest("hex"),
    };
  } finally {
    await handle.close();
  }
}

const handlers = await loadDecompressHandlers();
for (const path of process.argv.slice(2)) {
  let line;
  try {
    line = await contents(path, handlers);
  } catch (error) {
    line = { error: String(error.message ?? error) };
  }
  process.stdout.write(JSON.stringify(line) + "\n");
}

// Watches a run with Foxglove's own client library, and prints what comes.
//
// usage: npm install @foxglove/ws-protocol ws; node live_check.mjs ws://127.0.0.1:8765 [STATES]
import protocol from "@foxglove/ws-protocol";
import { WebSocket } from "ws";

const { FoxgloveClient } = protocol;
const [url, wanted = "100"] = process.argv.slice(2);
const client = new FoxgloveClient({ ws: new WebSocket(url, ["foxglove.sdk.v1"]) });
const topics = new Map();
const counts = {};
let [last, times] = [-1n, 0];

client.on("error", (error) => {
  console.error("error:", error);
  process.exit(1);
});
client.on("serverInfo", (info) => console.log("server:", info.name, JSON.stringify(info.capabilities)));
client.on("advertise", (channels) => {
  for (const channel of channels) {
    if (channel.encoding !== "protobuf" || channel.schemaEncoding !== "protobuf" || !channel.schema) {
      throw new Error(`no schema on ${channel.topic}`);
    }
    topics.set(client.subscribe(channel.id), channel.topic);
  }
});
client.on("time", ({ timestamp }) => {
  if (timestamp < 0n) throw new Error("a time before the start");
  times += 1;
});
client.on("message", ({ subscriptionId, timestamp }) => {
  const topic = topics.get(subscriptionId);
  counts[topic] = (counts[topic] ?? 0) + 1;
  if (topic !== "/particles") return;
  if (timestamp < last) throw new Error(`a state of ${timestamp} ns after one of ${last} ns`);
  last = timestamp;
  if (counts[topic] === Number(wanted)) {
    console.log(`${wanted} states in order up to ${last} ns, ${times} times;`, JSON.stringify(counts));
    process.exit(0);
  }
});
client.on("close", () => {
  console.error("closed early:", JSON.stringify(counts));
  process.exit(1);
});

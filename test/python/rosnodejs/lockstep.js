// Drives a server in lock-step through rosnodejs: node lockstep.js SERVER SEED ROWS < ACTIONS
// ACTIONS is a JSON array of actions. Writes one row per reset and per step to the file ROWS, in native
// doubles: observation, reward, terminated, truncated. Resets without a seed after each episode.
'use strict';
const fs = require('fs');
const rosnodejs = require('rosnodejs');

function record(answer, file) {
  if (!answer.success) throw new Error(answer.status_message);
  const state = answer.transition;
  const flags = [state.terminated, state.truncated].map(Number);
  const row = Float64Array.of(...state.observation, state.reward, ...flags);
  fs.writeSync(file, Buffer.from(row.buffer));
  return state.terminated || state.truncated;
}

async function main(server, seed, rows, actions) {
  const file = fs.openSync(rows, 'w');
  const node = await rosnodejs.initNode('/rosnodejs', {onTheFly: true, logging: {skipRosLogging: true}});
  const persist = {persist: true};
  const reset = node.serviceClient(`${server}/reset`, 'walker_sim/Reset', persist);
  const step = node.serviceClient(`${server}/step`, 'walker_sim/Step', persist);
  const world = {preset: '', parameters: []};  // the server's own; rosnodejs fills in no messages
  record(await reset.call({has_seed: true, seed, world}), file);
  for (const action of actions) {
    if (record(await step.call({action}), file)) {
      record(await reset.call({has_seed: false, seed: 0, world}), file);
    }
  }
}

const [server, seed, rows] = process.argv.slice(2);
main(server, Number(seed), rows, JSON.parse(fs.readFileSync(0)))
  .then(() => process.exit(0), (error) => {
    console.error(error);
    process.exit(1);
  });

// node validate.mjs FILE ...: what Khronos' validator says of each file, as JSON by file name.
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';

const require = createRequire(new URL('./', import.meta.url));
const validator = require('gltf-validator');
const said = {};
for (const file of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 0 });
  said[file] = report.issues.messages;
}
console.log(JSON.stringify(said));

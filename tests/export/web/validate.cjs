// Print what Khronos' validator says of each file: [{numErrors, numWarnings, messages: [...]}, ...].
const fs = require("fs");
const validator = require("gltf-validator");
const options = { maxIssues: 200 };
Promise.all(process.argv.slice(2).map((path) => validator.validateBytes(new Uint8Array(fs.readFileSync(path)), options)))
  .then((reports) => console.log(JSON.stringify(reports.map((report) => report.issues))));

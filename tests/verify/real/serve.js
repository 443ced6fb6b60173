// The lines that a JavaScript program needs to be asked: one request and one answer a line.
const readline = require("node:readline");

module.exports = function serve(greeting, tasks) {
  const plain = (key, value) => (ArrayBuffer.isView(value) ? Array.from(value) : value);
  readline.createInterface({ input: process.stdin }).on("line", (line) => {
    const request = JSON.parse(line);
    let answer = { protocol: 1, tasks: Object.keys(tasks), ...greeting };
    if (request.task !== "greeting") {
      try {
        answer = tasks[request.task](request);
      } catch (error) {
        answer = { error: error.message };
      }
    }
    console.log(JSON.stringify({ id: request.id, ...answer }, plain));
  });
};

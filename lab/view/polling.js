// Stands for a page's WebSocket where a proxy passes none (polled_pages.py): news are fetched by GET requests, which the server
// holds until there are some, and messages are sent by GET requests one after another.
"use strict";

class PolledSocket {
  static last = ""; // the key of the page before, whose place the next one takes

  constructor() {
    this.count = 0;
    this.sending = Promise.resolve();
    this.leaves = () => this.ask("leave", {}, { keepalive: true }).catch(() => {});
    addEventListener("pagehide", this.leaves);
    this.fetchAll();
  }

  async ask(name, more, options = {}) {
    const address = new URL(`${name}${location.search}`, location.href);
    for (const [key, value] of Object.entries({ page: this.key || "", n: ++this.count, ...more })) address.searchParams.set(key, value);
    const answer = await fetch(address, { cache: "no-store", ...options });
    if (!answer.ok) throw new Error(`${name}: ${answer.status}`);
    return answer;
  }

  async fetchAll() {
    let ended = [1006, ""];
    try {
      const { page } = await (await this.ask("open", { instead: PolledSocket.last })).json();
      this.key = PolledSocket.last = page;
      this.onopen();
      while (!this.closed) {
        const { news, ended: told } = await (await this.ask("news", {})).json();
        if (told) {
          ended = told;
          break;
        }
        if (news) this.onmessage({ data: news });
      }
    } catch (reason) {
      console.warn(reason.message);
    }
    removeEventListener("pagehide", this.leaves);
    this.onclose({ code: ended[0], reason: ended[1] });
  }

  send(text) {
    this.sending = this.sending.then(() => this.ask("say", { say: text })).catch(() => { this.closed = true; });
  }
}

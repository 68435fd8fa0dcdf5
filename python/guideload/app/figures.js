// Judgement and figures: a component of its own, because a change of an element of the page draws the whole page anew.
export default {
  template: `
    <div>
      <div class="verdict" role="status" :style="{ borderColor: state.color }">
        <q-icon :name="state.icon" size="28px" :style="{ color: state.color }" aria-hidden="true" />
        <span class="text-weight-medium" :style="{ color: state.color }">{{ state.verdict }}</span>
      </div>
      <div class="figures" role="list">
        <div v-for="one in state.figures" :key="one.name" class="figure" role="listitem">
          <div class="name">{{ one.name }}</div>
          <div class="value" :style="{ color: one.color }">{{ one.value }}</div>
          <div class="place">{{ one.place }}</div>
          <div class="reason" :style="{ color: one.color }">{{ one.reason }}</div>
        </div>
      </div>
    </div>`,
  props: { first: Object },
  data() {
    return { state: this.first };
  },
  methods: {
    show(state) {
      this.state = state;
    },
  },
};
